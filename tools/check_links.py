#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Links inside the repository's Markdown lead somewhere: to files that exist and headings that they have. So do file
names in backquotes, `module/file.hpp` or `tests/module/file.cpp`. Addresses on the network are not looked at.

    check_links.py [ROOT]        exit code 1 and a line for each that leads nowhere
    check_links.py --self-test   the check notices what it is for
"""

import re
import sys
import tempfile
from pathlib import Path

MADE = {"build", "out", "node_modules"}
ENDINGS = {".hpp", ".cpp", ".py", ".md", ".sh", ".json", ".yaml", ".bib", ".cmake", ".js", ".mjs", ".gz", ".txt"}


def prose(text):
    """The lines with their numbers, without code blocks (fenced, or indented after an empty line)."""
    fenced = indented = False
    before = ""
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith(("```", "~~~")):
            fenced = not fenced
        elif line.startswith("    ") and (indented or not before.strip()):
            indented = True
        elif line.strip():
            indented = False
            if not fenced:
                yield number, line
        before = line


def anchor(heading):
    """GitHub's name of a heading: letters, digits, - and _, in small letters."""
    heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def anchors(text):
    found = set()
    for _, line in prose(text):
        heading = re.match(r"#{1,6}\s+(.*?)\s*#*$", line)
        if heading:
            name, count = anchor(heading.group(1)), 0
            while (name if not count else f"{name}-{count}") in found:
                count += 1
            found.add(name if not count else f"{name}-{count}")
    return found


def wrong_in(page, root):
    text = page.read_text(encoding="utf-8")
    for number, line in prose(text):
        place = f"{page.relative_to(root)}:{number}"
        for target in re.findall(r"\[[^\]]*\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", line)):
            if re.match(r"[a-z][a-z0-9+.-]*:", target):
                continue
            path, _, fragment = target.partition("#")
            file = (page.parent / path) if path else page
            if not file.exists():
                yield f"{place}: {target}: there is no such file"
            elif fragment and file.suffix == ".md" and fragment not in anchors(file.read_text(encoding="utf-8")):
                yield f"{place}: {target}: there is no such heading"
        for name in re.findall(r"`([\w.+/-]+)`", line):
            path = Path(name)
            if len(path.parts) < 2 or path.is_absolute() or path.suffix not in ENDINGS or path.parts[0] in MADE:
                continue
            if (root / path.parts[0]).is_dir() and not (root / path).exists():
                yield f"{place}: {name}: there is no such file"


def pages(root):
    # docs/site is the frame of the site, whose links tools/docs.sh checks.
    return sorted(root.glob("*.md")) + sorted(path for path in (root / "docs").rglob("*.md") if path.parent.name != "site")


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "docs").mkdir()
        (root / "core").mkdir()
        (root / "core" / "log.hpp").touch()
        (root / "docs" / "a.md").write_text("# One, `two`: three\n\n## Again\n\n## Again\n", encoding="utf-8")
        page = root / "README.md"

        def wrong(text):
            page.write_text(text, encoding="utf-8")
            return len(list(wrong_in(page, root)))

        assert anchors("# A [link](x) & `b_c` — d\n") == {"a-link--b_c--d"}
        assert wrong("[a](docs/a.md#one-two-three) [b](docs/a.md#again-1) [c](https://nowhere.example/x) "
                     "`core/log.hpp`\n"
                     "`[d](e)` `result/model.json` `build/x.json`\n\n    [e](in/code.md)\n\n"
                     "```\n[f](in/code.md)\n```\n") == 0
        assert wrong("# Here\n[a](#here)\n") == 0
        for text in ("[a](docs/b.md)", "[a](docs/a.md#two)", "[a](docs/a.md#again-2)", "[a](#here)", "`core/lag.hpp`",
                     "- x\n    [a](docs/b.md)", "    code\n\nprose [a](docs/b.md)"):
            assert wrong(text + "\n") == 1, text
    print("links: self-test passed")


def main():
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent.parent).resolve()
    found = [complaint for page in pages(root) for complaint in wrong_in(page, root)]
    for complaint in found:
        print(complaint)
    if not found:
        print(f"links: {len(pages(root))} pages, all lead somewhere")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
