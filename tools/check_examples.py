#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the pages tell a reader to type works.

    check_examples.py PROGRAM     runs the console blocks of docs/tutorial.md and compares what they print, three dots for
                                  what is left out; looks up each option behind `wheelwright COMMAND` in README.md and
                                  docs/ in that command's help. Exit code 1 where something differs
    check_examples.py --self-test
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def blocks(text):
    """Commands with their expected lines, in order, of all console blocks."""
    runs = []
    for block in re.findall(r"^```console\n(.*?)^```", text, re.M | re.S):
        for line in block.splitlines():
            if line.startswith("$ "):
                runs.append((line[2:], []))
            else:
                runs[-1][1].append(line)
    return runs


def fits(expected, got):
    """Whether lines `got` are `expected`, where ... stands for anything, also for whole lines."""
    def pattern(line):
        return ".*".join(re.escape(part) for part in line.rstrip().split("..."))

    text = "".join(r"(?:.*\n)*?" if line.strip() == "..." else pattern(line) + r"[ ]*\n" for line in expected)
    return re.fullmatch(text, "".join(line.rstrip() + "\n" for line in got)) is not None


def run(program, page):
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "examples").symlink_to(ROOT / "examples")
        environment = {**os.environ, "PATH": f"{Path(program).resolve().parent}:{os.environ['PATH']}", "NO_COLOR": "1"}
        for command, expected in blocks(page.read_text(encoding="utf-8")):
            done = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, check=False)
            got = done.stdout.splitlines() + ([f"[exit code {done.returncode}]"] if done.returncode else [])
            if not fits(expected, got):
                yield f"{page.name}: $ {command}\n" + "\n".join(got) + "\n" + done.stderr


def examples(text):
    """Commands in code blocks and in backquotes: (command, options)."""
    text = re.sub(r"\\\n\s*", " ", text)
    code = re.findall(r"^(?: {4,}|\$ )(?:[$] )?((?:build/bin/)?wheelwright .*)$", text, re.M) + re.findall(r"`(wheelwright [^`]*)`", text)
    for line in code:
        words = line.split("#")[0].split()[1:]
        if words and re.fullmatch(r"[a-z]+", words[0]):
            yield words[0], [word.split("=")[0] for word in words[1:] if re.match(r"--[a-z]", word)]


def wrong_options(pages, help_of):
    for page in pages:
        for command, options in examples(page.read_text(encoding="utf-8")):
            known = help_of(command)
            if known is None:
                yield f"{page.name}: wheelwright {command}: there is no such command"
                continue
            for option in options:
                if not re.search(re.escape(option) + r"(?![\w-])", known):
                    yield f"{page.name}: wheelwright {command} {option}: there is no such option"


def self_test():
    assert blocks("```console\n$ a b\nx\n$ c\n```\n") == [("a b", ["x"]), ("c", [])]
    assert fits(["a", "...", "b...d"], ["a", "1", "2", "b c d"]) and fits(["...", "z"], ["z"])
    assert not fits(["a"], ["b"]) and not fits(["a"], ["a", "b"]) and not fits(["a", "...", "b"], ["a"])
    page = "x `wheelwright detect` y\n\n    wheelwright detect LOG --model m.json   # --not-here\n    wheelwright gap L --robt=x\n"
    assert list(examples(page)) == [("detect", ["--model"]), ("gap", ["--robt"]), ("detect", [])]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p.md"
        path.write_text(page, encoding="utf-8")
        assert len(list(wrong_options([path], {"detect": "--model FILE", "gap": "--robot FILE"}.get))) == 1
        assert len(list(wrong_options([path], {"gap": "--robt"}.get))) == 2
    print("examples: self-test passed")


def main():
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__.strip())
    program = sys.argv[1]
    helps = {}

    def help_of(command):
        if command not in helps:
            done = subprocess.run([program, command, "--help"], capture_output=True, text=True, check=False)
            helps[command] = done.stdout if done.returncode == 0 else None
        return helps[command]

    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    found = list(wrong_options(pages, help_of)) + list(run(program, ROOT / "docs/tutorial.md"))
    for complaint in found:
        print("examples: " + complaint)
    if not found:
        print("examples: the tutorial prints what it says, and every option is there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
