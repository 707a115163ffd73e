"""The commands in samples/guides run as they stand, each guide in a folder of its own. Its first comment
`<!-- before ... -->` makes the files that it takes for granted. Usage: guides_test.py STX MODEL SHARED"""
import os
import re
import subprocess
import sys
import tempfile

stx, model = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
guides = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "samples", "guides")
env = dict(os.environ, PATH=os.path.dirname(stx) + ":" + os.environ["PATH"], MODEL=model)
names = sorted(os.listdir(guides))
failed = 0
for name in names:
    with open(os.path.join(guides, name), encoding="utf-8") as f:
        text = f.read()
    before = re.findall(r"<!-- before\n(.*?)-->", text, re.S)
    blocks = re.findall(r"```sh\n(.*?)```", text, re.S)
    assert blocks, name + " has no commands"
    with tempfile.TemporaryDirectory() as folder:
        script = "set -eu\n" + "".join(before + blocks)
        run = subprocess.run(["sh", "-c", script], cwd=folder, env=env, capture_output=True, text=True, check=False)
        missing = [f for f in re.findall(r" -o ([\w./]+\.(?:png|html|ply|mp4|exr))\b", "".join(blocks))
                   if not os.path.exists(os.path.join(folder, f))]
    if run.returncode != 0 or missing:
        failed += 1
        print(f"{name}: ended with {run.returncode}; missing: {missing}\n{run.stdout}{run.stderr}")
print(f"{len(names)} guides, {failed} failed")
sys.exit(1 if failed or len(names) < 6 else 0)
