#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The pages of the documentation that are made from the program, the schemas and the headers.

    docs_pages.py PROGRAM TAGS OUT      OUT/commands.md: the --help of every command; OUT/files.md: the JSON files by
                                        their schemas; OUT/api.md: the installed headers by module, with links into
                                        Doxygen's pages, which its tag file TAGS lists; OUT/references.md: the
                                        bibliography
    docs_pages.py --check SITE          exit code 1 where a page of SITE links to what SITE does not have, or fetches
                                        anything from the network
"""

import html
import json
import os
import re
import subprocess
import sys
import textwrap
import urllib.parse
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from pathlib import Path

import check_layers

ROOT = Path(__file__).resolve().parent.parent
MODULES = {
    "core": "errors, argument checks, outward-rounded intervals, log table, regression rows, linear algebra, "
            "statistics",
    "model": "robots as data, their faults and effects",
    "filter": "row filters (torque, odometry), batch and streaming, and propagation of noise bounds through them",
    "bounds": "feasible parameter set, interval hull, support function, certificates",
    "detector": "thresholds and decisions: the part that runs on the robot; margins, isolation",
    "files": "bytes, numbers, JSON, YAML, XML",
    "logs": "logs in CSV, rosbag2 and HDF5",
    "robots": "robot files, URDF, the on-line part of model.json",
    "sim": "simulator of the robot in closed loop, with faults and effects",
    "identify": "estimators and what they promise",
    "commission": "the pipeline from a log to a model",
    "inference": "robust and constrained fits, confidence regions, identifiability",
    "doctor": "log checks",
    "design": "manoeuvres",
    "gap": "the sim-to-real gap",
    "study": "sensitivity studies and fleets; work on threads, shards and ranks",
    "results": "results as JSON, with their schemas",
    "export": "the detector as a C header",
    "report": "the page of a result",
}


def help_of(program, *words):
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "100"}
    return subprocess.run(["wheelwright", *words, "--help"], executable=program, capture_output=True, text=True,
                          check=True,
                          env=environment).stdout


def wrapped(line, width=92):
    """A line of help, broken where it is long, under the beginning of its last column."""
    if len(line) <= width:
        return line
    column = re.match(r"(\s*)(\S.*?\s{2,})?", line).end()
    return textwrap.fill(line, width, subsequent_indent=" " * (column if column < width // 2 else 2),
                         break_on_hyphens=False,
                         break_long_words=False, drop_whitespace=True)


def fenced(text):
    return "```text\n" + "\n".join(map(wrapped, text.rstrip().splitlines())) + "\n```\n"


def commands(program):
    overview = help_of(program)
    listed = overview[re.search(r"^(Subcommands|SUBCOMMANDS|Commands):?", overview, re.M).end():]
    names = re.findall(r"^  ([a-z][\w-]*)", listed, re.M)
    assert "commission" in names and "detect" in names, names
    out = "# Commands\n\nWhat `wheelwright --help` and `wheelwright COMMAND --help` say.\n\n" + fenced(overview)
    for name in names:
        out += f"\n## {name}\n\n" + fenced(help_of(program, name))
    return out


def kind(schema):
    """The type of a value in a few words."""
    if schema is False:
        return "absent"
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return " or ".join(f"`{json.dumps(value)}`" for value in schema["enum"])
    if "$ref" in schema:
        return schema["$ref"].split("/")[-1].replace(".schema.json", ".json")
    for key in ("anyOf", "oneOf", "allOf"):
        if key in schema and "type" not in schema:
            return " or ".join(kind(each) for each in schema[key])
    types = schema.get("type", "any")
    text = " or ".join(types) if isinstance(types, list) else types
    if "array" in text and isinstance(schema.get("items"), dict):
        text = text.replace("array", f"array of {kind(schema['items'])}")
    return text


def rows(schema, prefix=""):
    required = set(schema.get("required", []))
    for name, value in schema.get("properties", {}).items():
        path = prefix + name
        described = value.get("description", "") if isinstance(value, dict) else ""
        yield path, kind(value), "" if name in required else "may be absent", described
        if isinstance(value, dict):
            yield from rows(value, path + ".")
            if isinstance(value.get("items"), dict):
                yield from rows(value["items"], path + "[].")


def cell(text):
    return html.escape(text, quote=False).replace("|", "\\|").replace("*", "\\*")


def files():
    out = ("# JSON files\n\nEvery result is JSON with a schema, which stands in `results/` and is installed to "
           "`share/wheelwright/schemas`. Units are SI; a number that is not finite is `null`.\n")
    for path in sorted((ROOT / "results").glob("*.schema.json")):
        schema = json.loads(path.read_text(encoding="utf-8"))
        out += f"\n## {path.name.replace('.schema.json', '')}\n\n{cell(schema.get('title', ''))}"
        out += f" ({path.name}). {cell(schema.get('description', ''))}\n\n"
        tables = [("", schema)] + list({**schema.get("definitions", {}), **schema.get("$defs", {})}.items())
        for name, part in tables:
            listed = list(rows(part))
            if not listed:
                continue
            if name:
                out += f"\nWhere it says {name}:\n\n"
            out += "| key | type | | meaning |\n|---|---|---|---|\n"
            for key, what, absent, described in listed:
                out += f"| `{key}` | {what.replace('|', chr(92) + '|')} | {absent} | {cell(described)} |\n"
    return out


def about(header):
    """The first sentence of a header: what stands behind its \\file, or over its first declaration."""
    lines = re.findall(r"^\s*/// ?(?!<)(.*)$", header.read_text(encoding="utf-8"), re.M)
    text = " ".join(line for line in lines[:6] if line.strip() != "\\file").replace("\\file", "")
    text = re.split(r"(?<=\.)\s", text.strip())[0]
    return text.rstrip(".:;") + "." if text else ""


def api(tags):
    pages = {}
    for compound in ElementTree.parse(tags).getroot().iterfind("compound[@kind='file']"):
        place = os.path.relpath(compound.findtext("path", ""), ROOT)
        pages[f"{place}/{compound.findtext('name')}"] = compound.findtext("filename", "")
    out = ("# C++ library\n\n"
           "One target for each module: `find_package(Wheelwright 0.1 REQUIRED COMPONENTS detector)`, then "
           "`target_link_libraries(… Wheelwright::detector)`. Headers are `<wheelwright/MODULE/HEADER>`. "
           '<a href="../api/index.html">All pages</a>, <a href="../api/annotated.html">all types</a>.\n')
    public = check_layers.public_headers(ROOT)
    for module, what in MODULES.items():
        headers = sorted(public.get(module, ()))
        if not headers:
            continue
        out += f"\n## {module}\n\n{what[0].upper() + what[1:]}.\n\n| header | |\n|---|---|\n"
        for header in headers:
            page = pages.get(header)
            assert page, f"{header}: Doxygen has no page of it"
            out += f'| <a href="../api/{page}">{header}</a> | {cell(about(ROOT / header))} |\n'
    return out


REFERENCES = ("# References\n\n"
              "Works that the project stands on, by the keys that pages and comments name. A number in brackets "
              "without a key, such as (23), is an equation of dixon2001.\n\n```{bibliography}\n:all:\n```\n")


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.ids = [], [], set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.ids |= {attrs[key] for key in ("id", "name") if attrs.get(key)}
        for key in ("href", "src", "xlink:href", "data"):
            if attrs.get(key):
                (self.links if tag in ("a", "area") else self.loads).append(attrs[key])


def complaints(site):
    pages = {path: Page(path.read_text(encoding="utf-8", errors="replace")) for path in sorted(site.rglob("*.html"))}
    for path, page in pages.items():
        at = path.relative_to(site)
        for link in page.links + page.loads:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                if link in page.loads and parts.scheme not in ("data", "javascript"):
                    yield f"{at}: fetches {link} from the network"
                continue
            target = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                yield f"{at}: {link}: there is no such file"
            elif parts.fragment == "nested-classes":
                continue  # Doxygen writes it where the nested classes are private, too
            elif parts.fragment and target in pages and urllib.parse.unquote(parts.fragment) not in pages[target].ids:
                yield f"{at}: {link}: there is no such place"


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--check":
        found = list(complaints(Path(sys.argv[2]).resolve()))
        for complaint in found[:50]:
            print("docs: " + complaint)
        return 1 if found else 0
    program, tags, out = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    for name, text in {"commands": commands(program), "files": files(), "api": api(tags),
                       "references": REFERENCES}.items():
        (out / f"{name}.md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
