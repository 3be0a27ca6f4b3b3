# SPDX-License-Identifier: MIT
"""Which constructs of Structured Text each system takes, and which document says so.

IEC 61131-3, 2nd edition, annex B is what MATIEC is made after (its readme names the final draft of 2001-12-10; the
rules have the same names in stage1_2/iec_bison.yy). OpenPLC Runtime and Beremiz compile with MATIEC (OpenPLC:
webserver/scripts/compile_program.sh; Beremiz: ProjectController.py). STruC++ 0.6.1, which newer OpenPLC editors have,
takes what stands here; what it does not take, or MATIEC does not, is no part of the interpreter's subset. CODESYS: pages of "CODESYS Development System",
content.helpme-codesys.com."""

STANDARD = {  # construct: (rule of annex B, or table of the standard, that MATIEC follows; page of the CODESYS help)
    "directly derived type": ("B.1.3.3 simple_type_declaration", "_cds_datatype_alias"),
    "enumeration without numbers": ("B.1.3.3 enumerated_type_declaration", "_cds_datatype_enum"),
    "named ARRAY type": ("B.1.3.3 array_type_declaration", "_cds_datatype_alias"),
    "STRUCT": ("B.1.3.3 structure_type_declaration", "_cds_obj_dut"),
    "initial value": ("B.1.4.3 var1_init_decl", "_cds_obj_dut"),
    "FUNCTION": ("B.1.5.1 function_declaration", "_cds_obj_function"),
    "FUNCTION_BLOCK": ("B.1.5.2 function_block_declaration", "_cds_obj_function_block"),
    "PROGRAM": ("B.1.5.3 program_declaration", "_cds_obj_program"),
    "CONFIGURATION": ("B.1.7 configuration_declaration", None),  # CODESYS has a task configuration in its project instead
    "AT": ("B.1.4.3 located_var_declarations", "_cds_at_declaration"),
    "VAR": ("B.1.4.3 var_declarations", "_cds_vartypes_var"),
    "VAR_INPUT": ("B.1.4.3 input_declarations", "_cds_vartypes_var_input"),
    "VAR_OUTPUT": ("B.1.4.3 output_declarations", "_cds_vartypes_var_output"),
    "VAR_IN_OUT": ("B.1.4.3 input_output_declarations", "_cds_vartypes_var_in_out"),
    "VAR_EXTERNAL": ("B.1.4.3 external_var_declarations", "_cds_vartypes_var_external"),
    "VAR_GLOBAL": ("B.1.4.3 global_var_declarations", "_cds_vartypes_var_global"),
    "VAR_GLOBAL CONSTANT": ("B.1.4.3 global_var_declarations", "_cds_vartypes_var_global"),
    "IF": ("B.3.2.3 if_statement", "_cds_st_instruction_if"),
    "CASE": ("B.3.2.3 case_statement", "_cds_st_instruction_case"),
    "FOR": ("B.3.2.4 for_statement", "_cds_st_instruction_for"),
    "WHILE": ("B.3.2.4 while_statement", "_cds_st_instruction_while"),
    "output in a call": ("B.3.2.2 param_assignment", "_cds_st_operator_output_assignment"),
    "call of a function without names": ("B.3.1 function_name '(' param_assignment ')'", "_cds_obj_function"),
    "function SHL": ("table 25", "_cds_operator_shl"),
    "function SHR": ("table 25", "_cds_operator_shr"),
    "function MIN": ("table 27", "_cds_struct_reference_operators"),
    "function MAX": ("table 27", "_cds_operator_max"),
}
CONVERSION = ("table 22", "_cds_operator_convert_integer")  # function A_TO_B

POINTERS = {
    "POINTER TO": "_cds_datatype_pointer",
    "dereferencing with ^": "_cds_datatype_pointer",
    "ADR": "_cds_operator_adr",
}


def taken_by(construct):
    """The systems that take it."""
    if construct in POINTERS:
        return {"CODESYS", "STruC++"}
    rule, page = CONVERSION if "_TO_" in construct else STANDARD.get(construct, (None, None))
    return ({"MATIEC", "OpenPLC", "STruC++"} if rule else set()) | ({"CODESYS"} if page else set())
