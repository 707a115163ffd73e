#!/usr/bin/env python3
"""The installed stx works for others, wherever it was moved.

Installs into one folder and moves that elsewhere; no installed file may name the build tree, the sources
or the first folder. Each installed header is compiled alone and includes nothing but the others, the
standard library, GLM, fmt and tl::expected. Then project/use.sh builds and runs a program against it. Where
the kernel allows it, that happens in a mount namespace without the build tree, the sources and the
development files of every library but those three.
"""
import concurrent.futures
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile

# Development files that a user of the library needs not have.
UNNEEDED = ["OpenEXR", "Imath", "assimp", "draco", "tbb", "oneapi", "hwy", "epoxy", "nlohmann", "pugixml.hpp",
            "CLI", "OpenImageIO", "EGL", "GL", "spng.h", "jpeglib.h"]
EXPECTED = ["bin/stx", "include/stx/stx.hpp", "share/man/man1/stx.1", "share/bash-completion/completions/stx",
            "share/zsh/vendor-completions/_stx", "share/fish/vendor_completions.d/stx.fish",
            "share/stx/schemas/info.schema.json", "share/stx/schemas/atlas.schema.json",
            "share/doc/stx/README.md", "share/doc/stx/LICENSE"]
# One for each room of the library that stx.hpp takes types from.
MOST_HEADERS = 14
ALLOWED_INCLUDE = re.compile(r"<([a-z_]+|glm/[\w/.]+|fmt/\w+\.h|tl/expected\.hpp)>$")


def run(command, **more):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
    if done.returncode != 0:
        sys.exit(f"{command} ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def check_files(prefix, forbidden):
    for name in EXPECTED:
        if not os.path.isfile(os.path.join(prefix, name)):
            sys.exit(f"{name} is not installed")
    for folder, _, names in os.walk(prefix):
        for name in names:
            path = os.path.join(folder, name)
            with open(path, "rb") as file:
                content = file.read()
            for path_inside in forbidden:
                if path_inside.encode() in content:
                    sys.exit(f"{path} names {path_inside}")


def check_headers(include, compiler):
    headers = sorted(glob.glob(os.path.join(include, "**", "*"), recursive=True))
    headers = [h for h in headers if os.path.isfile(h)]
    if len(headers) > MOST_HEADERS:
        sys.exit(f"{len(headers)} headers are installed, more than {MOST_HEADERS}: {headers}")
    for header in headers:
        with open(header, encoding="utf-8") as file:
            for line in re.findall(r"#\s*include (.+)", file.read()):
                ours = re.fullmatch(r'"(stx/.+)"', line)
                if not (ours and os.path.join(include, ours[1]) in headers or ALLOWED_INCLUDE.match(line)):
                    sys.exit(f"{header} includes {line}")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda h: run([compiler, "-std=c++20", "-fsyntax-only", "-Wall", "-Werror", "-x", "c++",
                                     "-I", include, "-include", h, "/dev/null"]), headers))
    print(f"{len(headers)} headers compile alone")


def hidden(folders):
    """What to put before a command so that it does not see the folders; empty where that is not possible."""
    script = "for f in $HIDE; do if [ -d $f ]; then mount -t tmpfs none $f; " \
             "elif [ -e $f ]; then mount --bind /dev/null $f; fi; done; exec \"$@\""
    prefix = ["env", "HIDE=" + " ".join(folders), "unshare", "-rm", "sh", "-euc", script, "sh"]
    gone = subprocess.run(prefix + ["test", "!", "-e", os.path.join(folders[0], "bin/stx")], capture_output=True)
    return prefix if gone.returncode == 0 else []


def main():
    build, source, build_type, cmake, compiler = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="stx-consumer-") as top:
        first, prefix, work = (os.path.join(top, name) for name in ("first", "moved", "work"))
        # Debug information names the sources, and so do assertions.
        strip, sources = ([], [source]) if build_type == "Release" else (["--strip"], [])
        run([cmake, "--install", build, "--prefix", first] + strip)
        os.rename(first, prefix)
        check_files(prefix, [build, first] + sources)
        check_headers(os.path.join(prefix, "include"), compiler)

        shutil.copytree(os.path.join(source, "tests/consumer/project"), os.path.join(top, "project"))
        for name in glob.glob(os.path.join(build, "samples", "amphora.*")):
            shutil.copy(name, top)
        os.mkdir(work)
        without = hidden([build, source] + ["/usr/include/" + name for name in UNNEEDED])
        print("the build tree is", "hidden" if without else "not hidden: no mount namespaces here")
        run(without + [os.path.join(top, "project/use.sh"), prefix, cmake, compiler, build, source], cwd=work)


if __name__ == "__main__":
    main()
