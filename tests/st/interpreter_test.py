#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The interpreter itself: what a program does, and what is no program."""

import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from st_lexer import StError
from st_machine import Machine

TYPES = """TYPE
  FIVE : ARRAY [3..7] OF WORD;
  COLOUR : (RED, GREEN, BLUE);
  PAIR : STRUCT A : UINT := 7; B : BYTE; END_STRUCT;
  METRES : UINT;
END_TYPE
"""
CONFIGURATION = """CONFIGURATION c
  VAR_GLOBAL shared : UINT; END_VAR
  VAR_GLOBAL CONSTANT top : UINT := 9; END_VAR
  RESOURCE r ON PLC
    TASK t (INTERVAL := T#10ms, PRIORITY := 0);
    PROGRAM main WITH t : p;
  END_RESOURCE
END_CONFIGURATION
"""


def machine(variables, body, before=""):
    return Machine(("a.st", f"{TYPES}{before}\nPROGRAM p VAR {variables} END_VAR {body} END_PROGRAM\n"), ("c.st", CONFIGURATION))


def run(variables, body, before="", times=(0,)):
    made = machine(variables, body, before)
    for now in times:
        made.scan(now)
    return made.programs["MAIN"][1]


class Programs(unittest.TestCase):
    def check(self, variables, body, before="", times=(0,), **expected):
        values = run(variables, body, before, times)
        self.assertEqual({name: values[name] for name in expected}, expected)

    def test_times_as_matiec_has_them(self):
        for text, x, q_at in (("T#1ms * x", 2147, 2147000), ("T#1ms * x", 2148, 0), ("T#1ms * x", 65535, 0),
                              ("T#1s * (x / 1000) + T#1ms * (x MOD 1000)", 2148, 2148000),
                              ("T#1s * (x / 1000) + T#1ms * (x MOD 1000)", 65535, 65535000)):
            for times in {0, max(0, q_at - 1), q_at}:
                found = run(f"t : TON; x : UDINT := {x};", f"t(IN := TRUE, PT := {text});", times=(0, times))["T"]["Q"]
                self.assertEqual(found, times >= q_at, (text, x, times))

    def test_pointers_to_the_bytes_of_a_variable(self):
        self.check("u : UINT := 4660; p : POINTER TO BYTE; b : BYTE; a : FIVE; n : BOOL;",
                   "n := p = 0; p := ADR(u); p := p + 1; b := p^; p^ := 16#FF; p := ADR(a); p := p + 3; p^ := 16#01;",
                   B=0x12, U=0xFF34, A=[0, 0x100, 0, 0, 0], N=True)


class Mistakes(unittest.TestCase):
    def check(self, message, variables, body, before=""):
        with self.assertRaises(StError) as caught:
            run(variables, body, before)
        self.assertRegex(str(caught.exception), rf"\Aa\.st:\d+: {message}")

    def test_the_place_is_told(self):
        with self.assertRaises(StError) as caught:
            Machine(("x.st", "PROGRAM p\nVAR\n  a : UINT;\nEND_VAR\n  a := 1;\n  b := 1;\nEND_PROGRAM\n"))
        self.assertEqual(str(caught.exception), "x.st:6: B: no such variable")

    def test_names(self):
        self.check("Y: no such variable", "x : UINT;", "x := y;")
        self.check("NOWHERE: no such type", "x : NOWHERE;", "")
        self.check("F: no such function", "x : UINT;", "x := f(x);")
        self.check("Q: no member of PAIR", "s : PAIR;", "s.Q := 1;")
        self.check("RED: this name is taken", "red : UINT;", "")
        self.check("LIMIT: this name is taken", "limit : UINT;", "")

    def test_types(self):
        self.check("UINT, not BYTE, should", "x : UINT; b : BYTE;", "x := b;")
        self.check("WORD, not UINT, should", "x : UINT; w : WORD;", "w := w AND x;")
        self.check("70000: not within UINT", "x : UINT;", "x := 70000;")
        self.check("BOOL, not UINT, should", "x : UINT;", "IF x THEN x := 1; END_IF;")
        self.check("COLOUR, not UINT, should", "c : COLOUR; x : UINT;", "c := x;")
        self.check("WORD_TO_BYTE|WORD, not BYTE, should", "b : BYTE;", "b := WORD_TO_BYTE(b);")
        self.check(r"\+: not for WORD", "w : WORD;", "w := w + 1;")
        self.check("X: not a first value of a BOOL", "x : BOOL := 1;", "")

    def test_indices(self):
        self.check(r"index 8: not within 3\.\.7", "a : FIVE; i : UINT := 8;", "a[i] := 1;")
        self.check(r"index 2: not within 3\.\.7", "a : FIVE; w : WORD;", "w := a[2];")

    def test_ranges(self):
        self.check("65536: not within UINT", "x : UINT := 65535;", "x := x + 1;")
        self.check("-1: not within UINT", "x : UINT;", "x := x - 1;")
        self.check("256: not within BYTE", "w : WORD := 16#0100; b : BYTE;", "b := WORD_TO_BYTE(w);")

    def test_arguments(self):
        block = """FUNCTION_BLOCK f VAR_INPUT I : UINT; END_VAR VAR_IN_OUT D : FIVE; END_VAR VAR_OUTPUT O : UINT; END_VAR
            O := I; END_FUNCTION_BLOCK"""
        self.check("D: VAR_IN_OUT of F, needs a variable", "b : f;", "b(I := 1);", block)
        self.check("J: no input of F", "b : f; a : FIVE;", "b(J := 1, D := a);", block)
        self.check("I: no input of F, or twice", "b : f; a : FIVE;", "b(I := 1, I := 2, D := a);", block)
        self.check("D: FIVE, not PAIR", "b : f; a : PAIR;", "b(D := a);", block)
        self.check("O: no input of F", "b : f; a : FIVE;", "b(O := 1, D := a);", block)
        self.check("MAX: 2 arguments, not 1", "x : UINT;", "x := MAX(x);")

    def test_what_is_not_to_be_written(self):
        block = "FUNCTION_BLOCK f VAR_INPUT I : UINT; END_VAR {} END_FUNCTION_BLOCK"
        self.check("I: not to be written", "b : f;", "b();", block.format("I := 1;"))
        self.check("B: its variables are its own", "b : f;", "b.I := 1;", block.format(""))
        self.check("TOP: no VAR_GLOBAL of this type", "", "", "FUNCTION_BLOCK f VAR_EXTERNAL top : UINT; END_VAR END_FUNCTION_BLOCK")

    def test_what_the_subset_does_not_have(self):
        for text in ("REPEAT x := 1; UNTIL TRUE END_REPEAT;", "RETURN;", "EXIT;", "x := 2#1010;", "x := -1;", "x := x XOR x;",
                     "CASE x OF 0, 1: x := 2; END_CASE;", "IF x = 0 THEN x := 1; END_IF", "t(IN := , PT := T#1s);", "// x\n", "x := 1.5;", "x := x ** 2;", "{pragma}", "x := THIS^.y;", "FOR x := 0 TO 9 BY 2 DO END_FOR;"):
            with self.subTest(text), self.assertRaisesRegex(StError, r"a\.st:\d+: "):
                run("x : UINT; t : TON;", text)
        for variables in ("x AT %MW5 : WORD;", "x AT %IW5 : UINT;", "y AT %IW5 : WORD; x : UINT;", "x : REAL;", "x : STRING;", "x, y : UINT;", "x : ARRAY [0..1] OF BYTE;",
                          "x : REFERENCE TO BYTE;"):
            with self.subTest(variables), self.assertRaisesRegex(StError, r"a\.st:\d+: "):
                run(variables, "")

    def test_pointers_stay_within_their_variable(self):
        self.check("a pointer to nothing", "p : POINTER TO BYTE;", "p^ := 16#01;")
        self.check("a pointer behind its variable", "p : POINTER TO BYTE; u : UINT;", "p := ADR(u); p := p + 2; p^ := 16#01;")

    def test_a_loop_without_end(self):
        self.check("WHILE: does not end", "x : UINT;", "WHILE TRUE DO x := 1; END_WHILE;")


cases.main()
