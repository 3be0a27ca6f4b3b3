#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The interpreter itself: differences between systems, and invalid programs."""


import cases
from cbcan_st.machine.lexer import StError
from cbcan_st.machine import Machine

BEFORE = """TYPE
  FIVE : ARRAY [3..7] OF WORD;
  COLOUR : (RED, GREEN, BLUE);
  PAIR : STRUCT A : UINT := 7; B : BYTE; END_STRUCT;
END_TYPE
FUNCTION_BLOCK f VAR_INPUT I : UINT; END_VAR VAR_IN_OUT D : FIVE; END_VAR VAR_OUTPUT O : UINT; END_VAR O := I; END_FUNCTION_BLOCK
"""
# Timing diagrams of IEC 61131-3, 2nd edition, tables 34 to 36 and figure 15, by hand, in scans of 10 ms. Of each: inputs, what PT or PV is, and
# by scan the inputs and the outputs, a letter each: 0 and 1, and a digit for ET in scans or CV.
DIAGRAMS = (
    ("SR", "S1 R", "", "00 10 00 01 11 01", "Q1", "0 1 1 0 1 0"),
    ("RS", "S R1", "", "00 10 00 01 11 10", "Q1", "0 1 1 0 0 1"),
    ("R_TRIG", "CLK", "", "1 1 0 1 1", "Q", "1 0 0 1 0"),
    ("F_TRIG", "CLK", "", "0 0 1 1 0 0", "Q", "1 0 0 0 1 0"),
    ("CTU", "CU R", "PV := 2", "00 10 10 00 10 00 10 11 01 00 10", "Q CV", "00 01 01 01 12 12 12 00 00 00 01"),
    ("CTD", "CD LD", "PV := 2", "00 10 01 00 10 10 00 10 00 10 11", "Q CV", "10 10 02 02 01 01 01 10 10 10 02"),
    ("TOF", "IN", "PT := T#30ms", "0 1 1 0 0 0 0 0 1 0 0 1 0 0 0 0", "Q ET", "00 10 10 10 11 12 03 03 10 10 11 10 10 11 12 03"),
    ("TP", "IN", "PT := T#30ms", "0 1 0 1 0 0 1 1 1 1 1 0 1 0 0 1 0 1", "Q ET", "00 10 11 12 00 00 10 11 12 03 03 00 10 11 12 03 00 10"))
CONFIGURATION = """CONFIGURATION c
  VAR_GLOBAL CONSTANT top : UINT := 9; END_VAR
  RESOURCE r ON PLC
    TASK t (INTERVAL := T#10ms, PRIORITY := 0);
    PROGRAM main WITH t : p;
  END_RESOURCE
END_CONFIGURATION
"""
MISTAKES = (  # message; variables; body
    ("Y: no such variable", "x : UINT;", "x := y;"),
    ("NOWHERE: no such type", "x : NOWHERE;", ""),
    ("Q: no such function", "x : UINT;", "x := q(x);"),
    ("MAX: no such function in this subset, or not with 1", "x : UINT;", "x := MAX(x);"),
    ("Q: no member of PAIR", "s : PAIR;", "s.Q := 1;"),
    ("RED: this name is taken", "red : UINT;", ""),
    ("LIMIT: this name is taken", "limit : UINT;", ""),
    ("EN: a keyword; a word should", "en : BOOL;", ""),
    ("UINT, not BYTE, should", "x : UINT; b : BYTE;", "x := b;"),
    ("WORD, not UINT, should", "x : UINT; w : WORD;", "w := w AND x;"),
    ("BOOL, not UINT, should", "x : UINT;", "IF x THEN x := 1; END_IF;"),
    ("COLOUR, not UINT, should", "c : COLOUR; x : UINT;", "c := x;"),
    ("WORD, not BYTE, should", "b : BYTE;", "b := WORD_TO_BYTE(b);"),
    (r"\+: not for WORD", "w : WORD;", "w := w + 1;"),
    ("X: not a first value of a BOOL", "x : BOOL := 1;", ""),
    (r"index 8: not within 3\.\.7", "a : FIVE; i : UINT := 8;", "a[i] := 1;"),
    ("70000: not within UINT", "x : UINT;", "x := 70000;"),
    ("65536: not within UINT", "x : UINT := 65535;", "x := x + 1;"),
    ("-1: not within UINT", "x : UINT;", "x := x - 1;"),
    ("-1: not within UDINT", "x : UDINT; d : DINT;", "d := d - 1; x := DINT_TO_UDINT(d);"),
    ("32768: not within INT", "i : INT := 32767;", "i := i + 1;"),
    ("-1: not within UINT", "x : UINT;", "x := -1;"),
    ("32768: not within INT", "i : INT := -32768;", "i := -i;"),
    (".* by zero", "x : UINT; y : UINT;", "x := 1 / y;"),
    (".* by zero", "x : UINT; y : UINT;", "x := 1 MOD y;"),
    (".* by zero", "r : REAL;", "r := 1.0 / r;"),
    ("cannot convert float infinity to integer", "r : REAL := 9999999.0; d : DINT;", "r := r * r; r := r * r; r := r * r; d := REAL_TO_DINT(r);"),
    ("-: not for WORD", "w : WORD;", "w := -w;"),
    ("X: not a first value of a UINT", "x : UINT := -1;", ""),
    ("REAL, not UINT, should", "x : UINT; r : REAL;", "r := x;"),
    ("MOD: not for REAL", "r : REAL;", "r := r MOD 2.0;"),
    ("ADR: of unsigned numbers only", "p : POINTER TO BYTE; i : INT;", "p := ADR(i);"),
    ("256: not within BYTE", "w : WORD := 16#0100; b : BYTE;", "b := WORD_TO_BYTE(w);"),
    ("D: VAR_IN_OUT of F, needs a variable", "b : f;", "b(I := 1);"),
    ("I: no input of F, or twice", "b : f; a : FIVE;", "b(I := 1, I := 2, D := a);"),
    ("O: no input of F", "b : f; a : FIVE;", "b(O := 1, D := a);"),
    ("FIVE, not PAIR, should", "b : f; a : PAIR;", "b(D := a);"),
    ("B: its variables are its own", "b : f;", "b.I := 1;"),
    ("TOP: no VAR_GLOBAL of this type", "END_VAR VAR_EXTERNAL top : UINT;", ""),
    ("Y: located variables have a VAR of their own", "x AT %IW5 : WORD; y : UINT;", ""),
    ("X: %IW5 is for a WORD or INT or UINT of a PROGRAM", "x AT %IW5 : BYTE;", ""),
    ("a pointer to nothing", "p : POINTER TO BYTE;", "p^ := 16#01;"),
    ("a pointer behind its variable", "p : POINTER TO BYTE; u : UINT;", "p := ADR(u); p := p + 2; p^ := 16#01;"),
    ("WHILE: does not end", "x : UINT;", "WHILE TRUE DO x := 1; END_WHILE;"),
    ("X: %IX5.1 is for a BOOL of", "x AT %IX5.1 : WORD;", ""),
    ("REPEAT: does not end", "x : UINT;", "REPEAT x := 1; UNTIL FALSE END_REPEAT;"),
    *((f"{label.split('.')[0]}: the second of its kind, or an empty range", "x : UINT;", f"CASE x OF 3..5: x := 1; 9, {label}: x := 2; END_CASE;")
      for label in ("4", "5..7", "0..8", "9", "8..7")),
    ("',|,: : should stand here", "c : COLOUR;", "CASE c OF RED, BLUE: c := RED; END_CASE;"),
    ("70000: not within UINT", "x : UINT;", "CASE x OF 1..70000: x := 2; END_CASE;"),
    # No part of the subset
    *(("", "x : UINT; t : TON;", body) for body in (
        "REPEAT x := 1; UNTIL TRUE DO END_REPEAT;", "RETURN;", "x := 2#1010;", "x := x XOR x;", "CASE x OF 0, 1..: x := 2; END_CASE;",
        "IF x = 0 THEN x := 1; END_IF", "t(IN := , PT := T#1s);", "// x\n", "x := 1.5;", "{pragma}", "FOR x := 0 TO 9 BY 2 DO END_FOR;")),
    *(("", variables, "") for variables in ("x : LREAL;", "x, y : UINT;", "x : ARRAY [0..1] OF BYTE := [1];", "x : ARRAY [0..1] OF BYTE := [1, 2, 3];", "END_VAR VAR NON_RETAIN x : UINT;", "x : REFERENCE TO BYTE;")),
)


def run(variables, body, times=(0,)):
    made = Machine(("a.st", f"{BEFORE}PROGRAM p VAR {variables} END_VAR {body} END_PROGRAM\n"), ("c.st", CONFIGURATION))
    for now in times:
        made.scan(now)
    return made.programs["MAIN"][1]


class Interpreter(cases.Case):
    def test_times_as_matiec_has_them(self):
        for text, x, q_at in (("T#1ms * x", 2147, 2147000), ("T#1ms * x", 2148, 0), ("T#1ms * x", 65535, 0),
                              ("T#1s * (x / 1000) + T#1ms * (x MOD 1000)", 2148, 2148000),
                              ("T#1s * (x / 1000) + T#1ms * (x MOD 1000)", 65535, 65535000)):
            for times in {0, max(0, q_at - 1), q_at}:
                found = run(f"t : TON; x : UDINT := {x};", f"t(IN := TRUE, PT := {text});", times=(0, times))["T"]["Q"]
                self.assertEqual(found, times >= q_at, (text, x, times))

    def test_pointers_to_the_bytes_of_a_variable(self):
        values = run("u : UINT := 4660; p : POINTER TO BYTE; b : BYTE; a : FIVE; n : BOOL;",
                     "n := p = 0; p := ADR(u); p := p + 1; b := p^; p^ := 16#FF; p := ADR(a); p := p + 3; p^ := 16#01;")
        self.assertEqual([values[name] for name in "BUAN"], [0x12, 0xFF34, [0, 0x100, 0, 0, 0], True])

    def test_signed_numbers_and_reals(self):
        values = run("i : INT; j : INT; k : INT; w : WORD := 16#FFF9; b : BYTE; s : SINT := 5; r : REAL := 0.1; q : DINT;",
                     "i := WORD_TO_INT(w); j := i / 2; k := i MOD 2; s := s - 6; b := SINT_TO_BYTE(s); r := r + 0.2; q := REAL_TO_DINT(r * 0.0 - 2.6);")
        self.assertEqual([values[name] for name in "IJKSBQ"], [-7, -3, -1, -1, 0xFF, -3])
        self.assertEqual(values["R"], 0.30000001192092896)  # 3E99999Ah
        values = run("i : INT := -5; j : INT; k : INT; r : REAL := -0.5;", "j := -i - -2; k := -(i + 1) * -3; r := -r * 3.0;")
        self.assertEqual([values[name] for name in "IJKR"], [-5, 7, -12, 1.5])

    def test_standard_blocks(self):
        for name, inputs, preset, scans, outputs, wanted in DIAGRAMS:
            given, shown = inputs.split(), []
            arguments = ", ".join([*(f"{each} := {each}" for each in given), *preset.splitlines()])
            variables = "".join(f"{each} : BOOL; " for each in given)
            made = Machine(("a.st", f"PROGRAM p VAR {variables} b : {name}; END_VAR b({arguments}); END_PROGRAM\n"), ("c.st", CONFIGURATION))
            values = made.programs["MAIN"][1]
            for number, bits in enumerate(scans.split()):
                values.update(zip(given, (bit == "1" for bit in bits)))
                made.scan(number * 10000)
                block = values["B"]
                shown.append("".join(str(block[each] // 10000 if each == "ET" else int(block[each])) for each in outputs.split()))
            self.assertEqual(" ".join(shown), wanted, name)

    def test_what_editors_write(self):
        found = run("x : ARRAY [2..4] OF INT := [1, -2, 16#10]; t : TIME := T#1m_2s500ms; END_VAR VAR CONSTANT k : INT := 3; END_VAR "
                    "VAR RETAIN _TMP_ADD1_OUT : INT; less : BOOL; late : TIME;", "_TMP_ADD1_OUT := ADD(x[3], MUL(k, SUB(9, DIV(x[4], 4)))); "
                    "less := LT(k, 4) AND GE(k, 3) AND NOT NE(k, 3); late := T#1.5s;")
        self.assertEqual([found[name] for name in ("X", "T", "_TMP_ADD1_OUT", "LESS", "LATE")], [[1, -2, 16], 62500000, 13, True, 1500000])

    def test_case_and_repeat(self):
        values = run("x : INT := 7; n : UINT; s : UINT; f : FIVE;", "REPEAT CASE x OF -3..-1, 2: n := n + 1; 3, 5..7: n := n + 10; ELSE n := n + 100; END_CASE; x := x - 1; "
                     "UNTIL x < -4 END_REPEAT; REPEAT s := s + 1; UNTIL TRUE END_REPEAT;")
        self.assertEqual([values["N"], values["S"], values["X"]], [444, 1, -5])

    def test_located_variables(self):
        text = "x AT %MX5.15 : BOOL; i AT %IW0 : INT; u AT %QW1 : UINT; d AT %MD6 : DINT; r AT %id7 : REAL; w AT %MD8 : DWORD; n AT %MD9 : UDINT;"
        made = Machine(("a.st", f"PROGRAM p VAR {text} END_VAR END_PROGRAM\n"), ("c.st", CONFIGURATION))
        self.assertEqual(made.programs["MAIN"][0].located,
                         {"%MX5.15": "X", "%IW0": "I", "%QW1": "U", "%MD6": "D", "%ID7": "R", "%MD8": "W", "%MD9": "N"})

    def test_each_task_has_its_interval(self):
        program = "PROGRAM p VAR n : UINT; END_VAR n := n + 1; END_PROGRAM\n"
        tasks = CONFIGURATION.replace("    PROGRAM", "    TASK u (INTERVAL := T#25ms, PRIORITY := 1);\n    PROGRAM other WITH u : p;\n    PROGRAM")
        made = Machine(("a.st", program), ("c.st", tasks))
        for _ in range(11):  # at 0, 5, .. 50 ms
            made.scan(0)
        self.assertEqual([made.interval, *(made.programs[name][1]["N"] for name in ("MAIN", "OTHER"))], [5000, 6, 3])
        for message, wrong in (("NOWHERE: no task with an INTERVAL", ("WITH t", "WITH nowhere")), ("X: only variables of a PROGRAM are located", ("top :", "x AT %MW5 :"))):
            with self.assertRaisesRegex(StError, rf"\Ac\.st:\d+: {message}"):
                Machine(("a.st", program), ("c.st", CONFIGURATION.replace(*wrong)))

    def test_mistakes_are_found_and_their_place(self):
        for message, variables, body in MISTAKES:
            with self.subTest(variables + body), self.assertRaisesRegex(StError, rf"\Aa\.st:\d+: {message}"):
                run(variables, body)


cases.main()
