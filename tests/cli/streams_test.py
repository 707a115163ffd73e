#!/usr/bin/env python3
"""Standard streams that are closed or cannot be written, and a system that gives no threads: the work goes
on, or ends with an exit code and a message, and never by a signal."""
import os
import resource
import subprocess
import sys
import tempfile
import time

import harness


def become_nobody():
    """Root may write anywhere, and is not counted."""
    if os.geteuid() == 0:
        os.setgid(65534)
        os.setuid(65534)


def run(command, cwd, closed=(), stderr=None, stdout=None, processes=None, nobody=False):
    def before():
        if nobody:
            become_nobody()
        for stream in closed:
            os.close(stream)
        if processes is not None:
            become_nobody()
            resource.setrlimit(resource.RLIMIT_NPROC, (processes, processes))

    return subprocess.run(command, cwd=cwd, stdin=subprocess.DEVNULL, stdout=stdout or subprocess.PIPE,
                          stderr=stderr or subprocess.PIPE, preexec_fn=before, timeout=120)


def main():
    args = harness.arguments(__doc__)
    wrong = []

    def expect(name, done, code):
        if done.returncode != code:
            wrong.append(f"{name}: exit code {done.returncode} instead of {code}: {done.stderr}")

    with tempfile.TemporaryDirectory() as folder, open("/dev/full", "wb") as full:
        os.chmod(folder, 0o777)
        model = harness.quad(folder)
        convert = [args.stx, "convert", model, "--views", "ring:2", "--size", "24x24", "-o"]
        video = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../fuzz/corpus/y4m/420jpeg.y4m")

        expect("error on a full disk", run([args.stx, "info", "none"], folder, stderr=full), 2)
        expect("error without stderr", run([args.stx, "info", "none"], folder, closed=[2]), 2)
        expect("work without stderr", run(convert + ["a.mp4"], folder, closed=[2]), 0)
        expect("work without any stream", run(convert + ["b.mp4"], folder, closed=[0, 1, 2]), 0)
        for name in ("a.mp4", "b.mp4"):
            expect(f"validate {name}", run([args.stx, "validate", name], folder), 0)
        gone, pipe = os.pipe()
        os.close(gone)
        expect("error into a closed pipe", run([args.stx, "info", "none"], folder, stderr=pipe), 2)
        for words in (["--help"], ["--version"], ["convert", "--help"], ["info", model]):
            expect(f"{words} on a full disk", run([args.stx] + words, folder, stdout=full), 2)
            expect(f"{words} without stdout", run([args.stx] + words, folder, closed=[1]), 2)
        # What is opened first does not become stdin.
        expect("film without stdin", run([args.stx, "background", video, "-o", "c.png"], folder, closed=[0]), 0)

        # Who may write nothing beside a device, or beside a link, writes to what they are.
        expect("report to a device", run(convert + ["nobody.mp4", "--report", "/dev/null"], folder, nobody=True), 0)
        shut = os.path.join(folder, "shut")
        os.mkdir(shut)
        os.symlink("../behind.mp4", os.path.join(shut, "link.mp4"))
        os.chmod(shut, 0o555)
        expect("through a link", run(convert + ["shut/link.mp4"], folder, nobody=True), 0)
        expect("beside a link", run(convert + ["shut/other.mp4"], folder, nobody=True), 2)
        if not os.path.exists(os.path.join(folder, "behind.mp4")):
            wrong.append("through a link: nothing is there")
        os.chmod(shut, 0o755)

        harness.write(os.path.join(folder, "list"), "quad.obj\nnone.obj\n")
        batch = [args.stx, "convert", "@list", "-o", "batch_{stem}.mp4", "--views", "ring:2", "--size", "24x24",
                 "--keep-going", "--report", "batch.jsonl"]
        for name, stream in (("full", full), ("pipe", pipe)):
            expect(f"batch, {name}", run(batch, folder, stderr=stream), 2)
            for output in ("batch_quad.mp4", "batch.jsonl"):
                path = os.path.join(folder, output)
                if not os.path.exists(path):
                    wrong.append(f"batch, {name}: no {output}")
                else:
                    os.remove(path)

        # Workers are copies of a process whose only other thread waits for signals.
        harness.write(os.path.join(folder, "many"), "".join(f"many{i}.obj\n" for i in range(40)))
        for i in range(40):
            os.link(model, os.path.join(folder, f"many{i}.obj"))
        many = subprocess.Popen([args.stx, "convert", "@many", "-o", "{stem}.mp4", "--views", "ring:2", "--size", "24x24", "--jobs", "2"],
                                cwd=folder, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)
        threads = 0
        while many.poll() is None:
            try:
                threads = max(threads, len(os.listdir(f"/proc/{many.pid}/task")))
            except OSError:
                pass
            time.sleep(0.002)
        if many.returncode != 0 or threads > 2:
            wrong.append(f"batch of 40: exit code {many.returncode}, {threads} threads: {many.stderr.read()}")

        # With no threads, or a few only.
        for processes in (0, 1, 2, 3):
            done = run(convert + [f"t{processes}.mp4", "--threads", "4"], folder, processes=processes)
            if done.returncode not in (0, 4):
                wrong.append(f"{processes} processes: exit code {done.returncode}: {done.stderr}")
            # An OBJ is read in a process of its own.
            if processes == 0 and (done.returncode != 4 or b"stx-decode' cannot be started" not in done.stderr):
                wrong.append(f"no process for a model: exit code {done.returncode}: {done.stderr}")
            done = run([args.stx, "convert", "a.mp4", "-o", f"own{processes}.mp4", "--threads", "4"], folder, processes=processes)
            if done.returncode not in (0, 4) or (processes == 0 and done.returncode != 0):
                wrong.append(f"{processes} processes, a file of ours: exit code {done.returncode}: {done.stderr}")
            done = run([args.stx, "render", "a.mp4", "--orbit", "3", "--size", "24x24", "--backend", "cpu", "-o", "p_%d.png"],
                       folder, processes=processes)
            if done.returncode not in (0, 4):
                wrong.append(f"{processes} processes, sequence: exit code {done.returncode}: {done.stderr}")
    print("\n".join(wrong))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
