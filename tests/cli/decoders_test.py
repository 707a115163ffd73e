#!/usr/bin/env python3
"""The program that decodes foreign files, seen from outside: where it is not there, is another, or where the kernel
filters no system calls; and that none of its processes stays.

    tests/cli/decoders_test.py build/release/bin/stx MODEL.obj SHARED_DIR
"""
import ctypes
import ctypes.util
import glob
import os
import subprocess
import sys
import tempfile
import time

EPERM = 1
ALLOW, ERRNO = 0x7FFF0000, 0x00050000
PR_SET_SECCOMP = 22


class Compare(ctypes.Structure):
    """libseccomp's condition on an argument of a system call."""
    _fields_ = [("arg", ctypes.c_uint), ("op", ctypes.c_int), ("a", ctypes.c_uint64), ("b", ctypes.c_uint64)]


def forbid_filters():
    """From now on no process of this one can filter its system calls, as in some containers."""
    lib = ctypes.CDLL("libseccomp.so.2")
    lib.seccomp_init.restype = ctypes.c_void_p
    rules = ctypes.c_void_p(lib.seccomp_init(ctypes.c_uint32(ALLOW)))
    lib.seccomp_rule_add_array.argtypes = [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_int, ctypes.c_uint, ctypes.POINTER(Compare)]
    equal = Compare(0, 4, PR_SET_SECCOMP, 0)
    number = lib.seccomp_syscall_resolve_name
    if (lib.seccomp_rule_add_array(rules, ERRNO | EPERM, number(b"seccomp"), 0, None) != 0
            or lib.seccomp_rule_add_array(rules, ERRNO | EPERM, number(b"prctl"), 1, ctypes.byref(equal)) != 0
            or lib.seccomp_load(rules) != 0):
        os._exit(99)


def left(mark):
    """Processes of stx-decode that were started with this mark in their environment."""
    found = []
    for path in glob.glob("/proc/[0-9]*"):
        try:
            if os.path.basename(os.readlink(path + "/exe")) == "stx-decode":
                with open(path + "/environ", "rb") as file:
                    if mark.encode() in file.read():
                        found.append(path)
        except OSError:
            pass
    return found


def main():
    stx, model = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    mark = f"STX_MARK={os.getpid()}"
    problems = []
    with tempfile.TemporaryDirectory(prefix="stx-decoders-") as folder:

        def run(words, code, said=(), **more):
            env = dict(os.environ, **dict([mark.split("=")]), **more.pop("env", {}))
            done = subprocess.run([stx] + words, cwd=folder, env=env, capture_output=True, text=True, timeout=300, **more)
            text = done.stdout + done.stderr
            if done.returncode != code or any(part not in text for part in said):
                problems.append(f"{' '.join(words)}: exit code {done.returncode}, expected {code} and {said}:\n{text}")
            return done

        draw = ["render", model, "-o", "a.tif", "--size", "32x32", "--no-clobber"]
        read = ["compare", "a.tif", "a.tif"]
        run(draw, 0)
        run(read + ["--decoder-isolation", "required"], 0)
        filters = subprocess.run([sys.executable, "-c", "pass"], preexec_fn=forbid_filters).returncode == 0
        if filters:
            unheld = {"preexec_fn": forbid_filters}
            run(["info", model, "-v"], 0, ["seccomp"], **unheld)
            if "seccomp" in run(["info", model], 0, **unheld).stderr:
                problems.append("it is said without -v")
            run(["info", model, "--decoder-isolation", "required"], 5, ["cannot be filtered"], **unheld)
            run(read + ["--decoder-isolation", "required"], 5, ["cannot be filtered"], **unheld)
            run(["doctor"], 0, ["missing   isolation"], **unheld)
        for place, code, said in [("/nowhere/stx-decode", 5, "is not at '/nowhere/stx-decode'; install the stx package"),
                                  ("/bin/true", 4, "ended before it began"), ("/bin/cat", 4, "install the stx package anew")]:
            done = run(["info", model], code, [said], env={"STX_DECODE": place})
            if done.stderr.count("\n") != 1:
                problems.append(f"more than one line: {done.stderr}")
        end = time.monotonic() + 20
        while left(mark) and time.monotonic() < end:
            time.sleep(0.05)
        if left(mark):
            problems.append(f"processes stay: {left(mark)}")
    for problem in problems:
        print(problem)
    if not filters:
        print("libseccomp's filter cannot be loaded here; what happens without one was not tried")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
