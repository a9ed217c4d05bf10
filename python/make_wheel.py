#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Packs the built package into a wheel; the build's target python_wheel runs it.

    make_wheel.py PACKAGE --version V --license FILE --out DIR     prints the wheel's path

The wheel is for the interpreter that runs this and for this system: the extension uses its shared libraries (Ceres,
NLopt, yaml-cpp, ...), which are not packed. The same package gives the same bytes.
"""

import argparse
import base64
import hashlib
import sys
import sysconfig
import zipfile
from pathlib import Path

SUMMARY = "Tight model-based fault detection for wheeled robots"


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return f"{python}-{python}-{platform}"


def package_files(package):
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    extensions = [path for path in package.iterdir() if path.name == "_core" + suffix]
    if not extensions:
        sys.exit(f"{package}: no _core{suffix}: build the target wheelwright_python with this interpreter first")
    plain = [path for path in package.iterdir() if path.suffix in (".py", ".pyi") or path.name == "py.typed"]
    return sorted(plain) + extensions


def make(package, version, licence, out):
    info = f"wheelwright-{version}.dist-info"
    entries = {f"wheelwright/{path.name}": path.read_bytes() for path in package_files(package)}
    entries[f"{info}/licenses/LICENSE"] = licence.read_bytes()
    entries[f"{info}/METADATA"] = (
        f"Metadata-Version: 2.1\nName: wheelwright\nVersion: {version}\nSummary: {SUMMARY}\nLicense: Apache-2.0\n"
        f"Requires-Python: >={sys.version_info.major}.{sys.version_info.minor}\nRequires-Dist: numpy\n").encode()
    entries[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: wheelwright\nRoot-Is-Purelib: false\nTag: {tag()}\n").encode()
    record = ""
    for name, content in entries.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    entries[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    out.mkdir(parents=True, exist_ok=True)
    wheel = out / f"wheelwright-{version}-{tag()}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.endswith(".so") else 0o644) << 16
            archive.writestr(entry, content)
    return wheel


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("package", type=Path)
    parser.add_argument("--version", required=True)
    parser.add_argument("--license", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    print(make(arguments.package, arguments.version, arguments.license, arguments.out))


if __name__ == "__main__":
    main()
