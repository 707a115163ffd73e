#!/usr/bin/env python3
"""The packages that cpack makes install, work and go again.

    tests/package/package_test.py build/release [--debian]

Makes the .deb files and the .tar.gz. The .deb have their dependencies, those of the codecs that are only
opened when needed among them; unpacked into an empty folder they run a small job. The .tar.gz is unpacked
anywhere and runs. With --debian, which CTest does not give, since it takes minutes and a mirror: lintian finds
no error, and, as root with debootstrap, a bare Debian 12 is made, `apt-get install ./stx_*.deb` installs stx
there, the main job runs with the sample model, a program is compiled against libstx-dev, python3-stx draws, and after `apt-get
purge` no file is left that was not there before. Where no bare Debian can be made the main job runs unpacked.
"""
import argparse
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile

MIRROR = "http://deb.debian.org/debian"
SUITE = "bookworm"
# Longer than any of these takes on a slow mirror; what is stuck must not hold the suite up.
STEP_SECONDS = 600
# What apt and dpkg keep for themselves, and what is made when a program of Debian's runs.
OWN_FILES = re.compile(r"^(var/(cache|log|lib/(apt|dpkg|ucf|systemd))|etc/(ld\.so\.cache|mailcap)|tmp|root|proc|sys|dev|run)(/|$)"
                       r"|__pycache__")
# Where the Python module was built, python3-stx is made, too.
PYTHON_MODULE = "python/stx/_stx*.so"
PYTHON = """import stx, sys
bundle = stx.convert(sys.argv[1], views="ring:2", size=(32, 32))
assert stx.render(bundle, bundle.views[0].camera).depth.shape == (32, 32)
"""
PROGRAM = """#include <stx/stx.hpp>
int main() { return stx::version() ? 0 : 1; }
"""


def run(command, quiet=False, **more):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=STEP_SECONDS,
                          **more)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout[-4000:]}")
    if not quiet:
        print(f"$ {' '.join(command)}", flush=True)
    return done.stdout


def fields(deb):
    return run(["dpkg-deb", "-f", deb], quiet=True)


def check_fields(debs):
    stx = fields(debs["stx"])
    # OpenImageIO is a library of the codecs alone.
    for library in ("libc6", "libopenexr-3-1-30", "libopenimageio2.4", "libwebp7", "libepoxy0", "libassimp5", "libseccomp2"):
        if not re.search(rf"^Depends:.*\b{re.escape(library)}\b", stx, re.M):
            sys.exit(f"stx does not depend on {library}:\n{stx}")
    if "libopenimageio" in fields(debs["libstx0.1"]):
        sys.exit("libstx0.1 depends on the libraries of the codecs, which it does not hold")
    names = run(["dpkg-deb", "-c", debs["stx"]], quiet=True)
    for name in ("bin/stx", "lib/stx/stx_codecs.so", "lib/stx/stx_models.so", "libexec/stx/stx-decode", "share/man/man1/stx.1.gz", "share/bash-completion/completions/stx",
                 "share/stx/schemas/info.schema.json", "share/stx/samples/main_job.sh", "share/stx/samples/slurm/submit", "share/doc/stx/copyright"):
        if f" ./usr/{name}\n" not in names:
            sys.exit(f"stx does not hold {name}")


    if "python3-stx" in debs and not re.search(r"^Depends:.*libstx0.1 \(= .*\bpython3-numpy\b", fields(debs["python3-stx"]), re.M):
        sys.exit(f"python3-stx does not depend on libstx0.1 and numpy:\n{fields(debs['python3-stx'])}")


def check_python(prefix, model):
    """The Python module of an unpacked package, by Debian's Python, where there is numpy."""
    places = glob.glob(os.path.join(prefix, "lib/python3/dist-packages"))
    if not places or subprocess.run(["/usr/bin/python3", "-c", "import numpy"], capture_output=True).returncode != 0:
        print("the Python module was not tried: it was not built, or there is no python3-numpy")
        return
    run(["/usr/bin/python3", "-B", "-c", PYTHON, model], env=dict(os.environ, PYTHONPATH=places[0]), quiet=True)
    print("the Python module works")


def check_lintian(debs):
    if not shutil.which("lintian"):
        print("lintian is not installed; the packages are not checked by it")
        return
    done = subprocess.run(["lintian", "--allow-root", "--fail-on", "error", "--tag-display-limit", "0"] + list(debs.values()),
                          capture_output=True, text=True, timeout=STEP_SECONDS)
    if done.returncode != 0:
        sys.exit(f"lintian finds errors:\n{done.stdout}{done.stderr}")
    print(f"lintian: no error, {done.stdout.count(chr(10))} warnings")


def files(root):
    """Every file, link and folder but what apt and dpkg keep."""
    found = set()
    for folder, folders, names in os.walk(root):
        for name in folders + names:
            path = os.path.relpath(os.path.join(folder, name), root)
            if not OWN_FILES.search(path):
                found.add(path)
        folders[:] = [f for f in folders if not OWN_FILES.search(os.path.relpath(os.path.join(folder, f), root))]
    return found


def bare_debian(root, build):
    """A bare Debian in `root`; a text that says why not, where that is impossible. The base is kept in the build tree."""
    if os.geteuid() != 0:
        return "only root can use chroot"
    if not shutil.which("debootstrap"):
        return "debootstrap is not installed"
    kept = os.path.join(build, "tests", f"debian-{SUITE}.tar")
    if not os.path.exists(kept):
        done = subprocess.run(["debootstrap", "--variant=minbase", SUITE, root, MIRROR], capture_output=True, text=True,
                              timeout=STEP_SECONDS)
        if done.returncode != 0:
            return "debootstrap cannot make one here: " + (done.stdout + done.stderr).strip().splitlines()[-1]
        run(["tar", "-C", root, "-cf", kept + ".part", "."])
        os.rename(kept + ".part", kept)
    else:
        run(["tar", "-C", root, "-xf", kept])
    # What this machine reaches its mirror by.
    for name in ("/etc/resolv.conf", "/etc/hosts"):
        shutil.copyfile(name, root + name)
    with open(os.path.join(root, "etc/apt/apt.conf.d/99test"), "w", encoding="ascii") as file:
        file.write('Acquire::Retries "2";\nAcquire::http::Timeout "30";\n')
        proxies = subprocess.run(["apt-config", "dump", "--format", "%f \"%v\";%n", "Acquire::http", "Acquire::https"],
                                 capture_output=True, text=True).stdout
        file.write(proxies)
    # Nobody needs this Debian after a power cut.
    with open(os.path.join(root, "etc/dpkg/dpkg.cfg.d/99test"), "w", encoding="ascii") as file:
        file.write("force-unsafe-io\n")
    update = subprocess.run(["chroot", root, "apt-get", "update", "-q"], capture_output=True, text=True,
                            timeout=STEP_SECONDS)
    if update.returncode != 0:
        return "apt-get update fails there: " + (update.stdout + update.stderr).strip().splitlines()[-1]
    return None


def in_chroot(root, debs):
    os.makedirs(os.path.join(root, "tmp/debs"))
    for deb in debs.values():
        shutil.copy(deb, os.path.join(root, "tmp/debs"))
    inside = {name: "./tmp/debs/" + os.path.basename(deb) for name, deb in debs.items()}
    apt = ["chroot", root, "env", "DEBIAN_FRONTEND=noninteractive", "LC_ALL=C.UTF-8", "apt-get", "-q", "-y"]
    before = files(root)
    run(apt + ["install", "--no-install-recommends", inside["stx"]], cwd=root)
    print(run(["chroot", root, "stx", "--version"]).strip())
    job = run(["chroot", root, "sh", "/usr/share/stx/samples/main_job.sh", "/usr/share/stx/samples/amphora.obj", "/tmp/job"])
    for name in ("bundle.exr", "atlas/colour.png", "novel.png", "relit.png"):
        if not os.path.isfile(os.path.join(root, "tmp/job", name)):
            sys.exit(f"the main job did not make {name}:\n{job}")
    # Writes a TIFF, by the codecs, and reads it.
    run(["chroot", root, "stx", "render", "/tmp/job/atlas", "-o", "/tmp/job/a.tif", "--size", "64x64", "--quiet"])
    run(["chroot", root, "stx", "compare", "/tmp/job/a.tif", "/tmp/job/a.tif"])
    installed = files(root) - before
    run(apt + ["install", "--no-install-recommends", inside["libstx0.1"], inside["libstx-dev"], "g++", "pkg-config"], cwd=root)
    with open(os.path.join(root, "tmp/main.cpp"), "w", encoding="ascii") as file:
        file.write(PROGRAM)
    run(["chroot", root, "sh", "-euc",
         "g++ -std=c++20 /tmp/main.cpp -o /tmp/main $(pkg-config --cflags --libs stx) && /tmp/main"])
    python = [name for name in debs if name == "python3-stx"]
    if python:
        run(apt + ["install", "--no-install-recommends", inside[python[0]]], cwd=root)
        run(["chroot", root, "python3", "-c", PYTHON, "/usr/share/stx/samples/amphora.obj"], quiet=True)
    run(apt + ["purge", "--autoremove", "stx", "libstx0.1", "libstx-dev", "g++", "pkg-config"] + python, cwd=root)
    left = files(root) - before
    if left:
        sys.exit(f"{len(left)} files stay after the packages were removed:\n" + "\n".join(sorted(left)[:40]))
    print(f"bare Debian: stx brought {len(installed)} files, the main job ran, nothing stays")


def unpacked(top, debs, model, whole):
    """Runs what was unpacked into an empty folder: the main job when `whole`, else a small one."""
    prefix = os.path.join(top, "unpacked")
    for deb in debs.values():
        run(["dpkg-deb", "-x", deb, prefix])
    env = dict(os.environ, PATH=os.path.join(prefix, "usr/bin") + ":" + os.environ["PATH"])
    job, atlas = os.path.join(top, "job"), os.path.join(top, "job/atlas")
    if whole:
        run(["sh", os.path.join(prefix, "usr/share/stx/samples/main_job.sh"), model, job], env=env)
    else:
        os.mkdir(job)
        run(["stx", "convert", model, "-o", os.path.join(job, "a.mp4"), "--views", "ring:4", "--size", "64x64"], env=env)
        run(["stx", "pack", os.path.join(job, "a.mp4"), "-o", atlas], env=env)
    run(["stx", "render", atlas, "-o", os.path.join(top, "a.tif"), "--size", "64x64"], env=env)
    check_python(os.path.join(prefix, "usr"), model)
    print(f"unpacked: {'the main job' if whole else 'a small job'} ran")


def archive(top, path):
    where = os.path.join(top, "archive")
    os.mkdir(where)
    run(["tar", "-C", where, "-xzf", path])
    folders = os.listdir(where)
    if len(folders) != 1:
        sys.exit(f"the archive holds {folders}; one folder is expected")
    prefix = os.path.join(where, folders[0])
    stx = os.path.join(prefix, "bin/stx")
    for name in ("include/stx/stx.hpp", "lib/libstx.so", "lib/pkgconfig/stx.pc", "share/stx/samples/amphora.obj",
                 "share/doc/stx/LICENSE"):
        if not os.path.exists(os.path.join(prefix, name)):
            sys.exit(f"the archive does not hold {name}")
    picture = os.path.join(top, "archive.tif")
    run([stx, "render", os.path.join(prefix, "share/stx/samples/amphora.obj"), "-o", picture, "--size", "64x64", "--quiet"])
    check_python(prefix, os.path.join(prefix, "share/stx/samples/amphora.obj"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--cpack", default="cpack")
    parser.add_argument("--debian", action="store_true", help="lintian, and a bare Debian in a chroot")
    args = parser.parse_args()
    args.build = os.path.abspath(args.build)
    for tool in ("dpkg-deb", "dpkg-shlibdeps"):
        if not shutil.which(tool):
            print(f"SKIPPED: {tool} is not here (packages dpkg, dpkg-dev)")
            return 77
    with tempfile.TemporaryDirectory(prefix="stx-package-") as top:
        # Of one run only, also when several work in one build tree.
        run([args.cpack, "--config", os.path.join(args.build, "CPackConfig.cmake"), "-B", top], cwd=top)
        debs = {os.path.basename(p).split("_")[0]: p for p in glob.glob(os.path.join(top, "*.deb"))}
        python = {"python3-stx"} if glob.glob(os.path.join(args.build, PYTHON_MODULE)) else set()
        if set(debs) != {"stx", "libstx0.1", "libstx-dev"} | python:
            sys.exit(f"cpack made {sorted(debs)}")
        check_fields(debs)
        archive(top, glob.glob(os.path.join(top, "*.tar.gz"))[0])
        model = os.path.join(args.build, "samples/amphora.obj")
        if not args.debian:
            unpacked(top, debs, model, False)
            return 0
        check_lintian(debs)
        root = os.path.join(top, "debian")
        os.mkdir(root)
        why = bare_debian(root, args.build)
        if why is not None:
            unpacked(top, debs, model, True)
            print(f"SKIPPED: no bare Debian: {why}")
            return 77
        in_chroot(root, debs)
    return 0


if __name__ == "__main__":
    sys.exit(main())
