#!/usr/bin/env python3
"""The stubs say what the module has, and everything public says what it does."""
import ast
import inspect
import pathlib
import re
import unittest

from harness import stx
from stx import _stx

FOLDER = pathlib.Path(stx.__file__).parent


def arguments(function):
    """Names of arguments that a stub declares, without self."""
    every = function.args.posonlyargs + function.args.args + function.args.kwonlyargs
    return [argument.arg for argument in every if argument.arg != "self"]


def members(kind):
    return {name for name in vars(kind) if not name.startswith("_") or name in ("__len__", "__iter__", "__getitem__")}


class Stubs(unittest.TestCase):
    def setUp(self):
        nodes = ast.parse((FOLDER / "_stx.pyi").read_text(encoding="utf-8")).body
        self.classes = {node.name: node for node in nodes if isinstance(node, ast.ClassDef)}
        self.functions = {node.name: node for node in nodes if isinstance(node, ast.FunctionDef)}

    def test_there_are_the_same_names(self):
        kinds = {name for name, value in vars(_stx).items() if inspect.isclass(value)}
        self.assertEqual(kinds, set(self.classes))
        functions = {name for name, value in vars(_stx).items() if inspect.isroutine(value)}
        self.assertEqual(functions, set(self.functions))
        for name, node in self.classes.items():
            stub = {f.name for f in node.body if isinstance(f, ast.FunctionDef)} - {"__init__", "__eq__"}
            self.assertEqual(stub, members(getattr(_stx, name)), name)

    def test_methods_have_the_same_arguments(self):
        for name, node in self.classes.items():
            for method in (f for f in node.body if isinstance(f, ast.FunctionDef)):
                text = getattr(getattr(_stx, name), method.name).__doc__ or ""
                signature = re.match(re.escape(method.name) + r"\((.*)\) ->", text)
                if signature and "arg0" not in signature[1] and "**" not in signature[1]:
                    found = re.findall(r"(?:^|, )(\w+): ", signature[1])
                    self.assertEqual([a for a in found if a != "self"], arguments(method), f"{name}.{method.name}")

    def test_everything_public_is_described(self):
        for name in stx.__all__:
            thing = getattr(stx, name)
            self.assertTrue(isinstance(thing, str) or inspect.getdoc(thing), name)
            for member in members(thing) if inspect.isclass(thing) and thing.__module__.endswith("_stx") else ():
                if not member.startswith("__"):
                    # What pybind11 adds is the signature alone.
                    self.assertRegex(inspect.getdoc(getattr(thing, member)) or "", r"\.$|\n", f"{name}.{member}")

    def test_types_are_marked(self):
        self.assertTrue((FOLDER / "py.typed").exists())


if __name__ == "__main__":
    unittest.main()
