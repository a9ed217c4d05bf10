#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Corpora of the fuzzers: tests/fuzzers/corpus/NAME.gz, for each input its size in decimal, a line end, its bytes and a line end.

    tests/fuzzers/corpus.py unpack FOLDER [NAME...]    inputs become FOLDER/NAME/*
    tests/fuzzers/corpus.py renew [NAME...]            after tests/fuzzers/run.sh: the inputs of most use, of all that build-fuzz has

Renewing takes inputs from build-fuzz/corpus, build-fuzz/seeds and the corpus that is there. libFuzzer says which features
(edges, and how often they are gone) each reaches; the input with the most new ones a packed byte is taken, again and again,
until nothing is new or the file has 40 KiB.
"""

import gzip
import os
import pathlib
import subprocess
import sys
import tempfile
import zlib

FUZZ = pathlib.Path(__file__).resolve().parent
CORPUS = FUZZ / "corpus"
BUILD = FUZZ.parents[1] / "build-fuzz"
MOST_BYTES = 40 << 10
MOST_INPUT = 64 << 10


def unpacked(name):
    """The inputs of a fuzzer."""
    file = CORPUS / f"{name}.gz"
    packed = gzip.decompress(file.read_bytes()) if file.exists() else b""
    inputs, at = [], 0
    while at < len(packed):
        begin = packed.index(b"\n", at) + 1
        end = begin + int(packed[at : begin - 1])
        assert packed[end : end + 1] == b"\n", f"{file} is damaged"
        inputs.append(packed[begin:end])
        at = end + 1
    return inputs


def packed(inputs):
    """Bytes of the file that has them; small ones stand together, so that they are packed with each other's words."""
    text = b"".join(b"%d\n%b\n" % (len(each), each) for each in sorted(inputs, key=lambda each: (len(each), each)))
    return gzip.compress(text, 9, mtime=0)


def features(name, inputs):
    """The features that each input reaches."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "all").mkdir()
        (folder / "best").mkdir()
        for number, each in enumerate(inputs):
            (folder / "all" / f"{number:06}").write_bytes(each)
        subprocess.run([BUILD / "bin" / f"fuzz_{name}", "-set_cover_merge=1", f"-merge_control_file={folder / 'control'}",
                        "-timeout=20", "-malloc_limit_mb=2147483647", "-rss_limit_mb=4096", folder / "best", folder / "all"],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                       env=os.environ | {"ASAN_OPTIONS": "allocator_may_return_null=1:detect_leaks=0", "TMPDIR": str(folder)})
        lines = (folder / "control").read_text().splitlines()
    files = [int(pathlib.Path(line).name) for line in lines[2 : 2 + int(lines[0])]]
    reached = {}
    for line in lines:
        if line.startswith("FT "):
            number, *those = line.split()[1:]
            reached[files[int(number)]] = frozenset(map(int, those))
    return reached


def chosen(inputs, reached):
    """Inputs of most use, and how many features they reach."""
    cost = {number: len(zlib.compress(inputs[number], 9)) + 8 for number in reached}
    left, known, taken = dict(reached), set(), []
    while left:
        gain = {number: len(those - known) for number, those in left.items()}
        left = {number: those for number, those in left.items() if gain[number] > 0}
        if not left:
            break
        best = max(left, key=lambda number: (gain[number] / cost[number], -number))
        if len(packed(taken + [inputs[best]])) <= MOST_BYTES:
            taken.append(inputs[best])
            known |= left[best]
        del left[best]
    return taken, len(known)


def renew(name):
    """Writes the corpus of a fuzzer anew."""
    inputs = set(unpacked(name))
    for folder in BUILD / "corpus" / name, BUILD / "seeds" / name:
        if folder.is_dir():
            inputs |= {file.read_bytes() for file in folder.iterdir()}
    inputs = sorted((each for each in inputs if len(each) <= MOST_INPUT), key=lambda each: (len(each), each))
    reached = features(name, inputs)
    taken, known = chosen(inputs, reached)
    CORPUS.mkdir(exist_ok=True)
    (CORPUS / f"{name}.gz").write_bytes(packed(taken))
    print(f"{name:<12} {len(taken):>5} of {len(inputs):>5} inputs, {known:>6} of {len(set().union(*reached.values())):>6} "
          f"features, {(CORPUS / f'{name}.gz').stat().st_size:>6} bytes", flush=True)


def main(arguments):
    """Runs a command."""
    if arguments[:1] == ["unpack"] and len(arguments) > 1:
        for name in arguments[2:] or sorted(file.stem for file in CORPUS.glob("*.gz")):
            folder = pathlib.Path(arguments[1]) / name
            folder.mkdir(parents=True, exist_ok=True)
            for number, each in enumerate(unpacked(name)):
                (folder / f"{number:04}").write_bytes(each)
    elif arguments[:1] == ["renew"]:
        for name in arguments[1:] or sorted(file.stem for file in FUZZ.glob("*.cpp") if not file.stem.endswith("_test")):
            renew(name)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
