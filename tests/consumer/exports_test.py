#!/usr/bin/env python3
"""What the built libraries show: `exports_test.py LIBSTX MODULES CMAKE SOURCE`.

libstx.so shows each function that an installed header declares without its body, and nothing else
(formats/stx/exports.map lists them). A module shows the functions that give its tables. Prints what is
missing and what is too much.
"""
import collections
import glob
import os
import re
import subprocess
import sys
import tempfile

TOKENS = re.compile(r'"(?:\\.|[^"\\])*"|~?[A-Za-z_]\w*|::|\S')
# How a declaration begins that is no function of the library.
NO_FUNCTION = {"using", "typedef", "static_assert", "friend", "enum", "template"}


def function_of(statement):
    """The name of the function that a declaration without a body declares; "" when it is none."""
    if "(" not in statement or NO_FUNCTION & set(statement[:1]) or statement[-2:] in (["=", "0"], ["=", "default"],
                                                                                      ["=", "delete"]):
        return ""
    before = statement[:statement.index("(")]
    # `int size = at(0);` and `std::function<void(int)> call;` declare values.
    if "=" in before or before.count("<") != before.count(">") or not re.match(r"~?[A-Za-z_]", before[-1]):
        return ""
    return before[-1]


def declared_functions(text):
    """Full names of functions that are declared without a body, each as often as it is overloaded."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", text, flags=re.S)
    text = re.sub(r"^\s*#(?:[^\n]*\\\n)*[^\n]*", " ", text, flags=re.M)
    found, scopes, statement, inside = collections.Counter(), [], [], 0
    for token in TOKENS.findall(re.sub(r"\[\[.*?\]\]", " ", text)):
        if inside:  # of a body or an initialiser
            inside += {"{": 1, "}": -1}.get(token, 0)
            if not inside and ")" in statement and statement.count("(") == statement.count(")"):
                statement = []
        elif token == "{":
            scope = re.match(r"(?:namespace|class|struct) (\w+)(?: final)?(?: :.*)?$", " ".join(statement))
            if scope:
                scopes.append(scope[1])
                statement = []
            else:
                inside = 1
        elif token == "}":
            scopes.pop()
            statement = []
        elif token == ";" and statement.count("(") == statement.count(")"):
            name = function_of(statement)
            if name:
                found["::".join(scopes + [name])] += 1
            statement = []
        elif token == ":" and statement[-1:] in (["public"], ["private"], ["protected"]):
            statement = []
        else:
            statement.append(token)
    return found


def exported(library):
    """What a library shows: (type, demangled name)."""
    lines = subprocess.run(["nm", "-D", "--defined-only", "-C", library], check=True, stdout=subprocess.PIPE, text=True)
    return sorted({tuple(line.split(" ", 2)[1:]) for line in lines.stdout.splitlines()})


# What a module answers in the place of a library that it calls.
ANSWERED = [("stx_heif.so", "de265_start_worker_threads")]


def unlike(shown, wanted):
    """A line for each function that is shown and not declared, or the other way round."""
    classes = {name.rsplit("::", 1)[0] for name in wanted if name.count("::") > 1}
    names = {symbol: re.match(r"[\w:~]+", symbol)[0] for _, symbol in shown}
    # A class shows its inline members, too: the headers have their bodies.
    strong = [symbol for kind, symbol in shown if kind != "W" or names[symbol].rsplit("::", 1)[0] not in classes]
    count = collections.Counter(names[symbol] for symbol in strong)
    return [f"libstx.so shows {symbol}: no installed header declares it" for symbol in strong
            if count[names[symbol]] > wanted[names[symbol]]] + \
        [f"libstx.so lacks {name}, which an installed header declares: add it to formats/stx/exports.map"
         for name in sorted(wanted) if count[name] < wanted[name]]


def main():
    library, modules, cmake, source = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="stx-exports-") as folder:
        subprocess.run([cmake, f"-DSOURCE={source}", f"-DINCLUDEDIR={folder}", "-P",
                        os.path.join(source, "formats/stx/install_headers.cmake")], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
        wanted = collections.Counter()
        for header in sorted(glob.glob(os.path.join(folder, "stx", "*.hpp"))):
            with open(header, encoding="utf-8") as file:
                wanted += declared_functions(file.read())
    errors = unlike(exported(library), wanted)
    for module in sorted(glob.glob(os.path.join(modules, "*.so"))):
        errors += [f"{os.path.basename(module)} shows {symbol}" for _, symbol in exported(module)
                   if symbol not in ("stxDecoder", "stxCodecs") and (os.path.basename(module), symbol) not in ANSWERED]
    if errors:
        sys.exit("\n".join(errors))
    print(f"{sum(wanted.values())} functions are shown")


if __name__ == "__main__":
    main()
