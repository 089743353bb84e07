"""Lays out what the site is made of, as it lies in the repository, so that links between pages hold as they are written.

usage: gather.py ROOT PAGES      copies every page of ROOT, and the files that pages link to and show, into the new folder PAGES
"""

import pathlib
import posixpath
import re
import shutil
import sys

TOPS = ("docs", "bench", "scenes")
LINK = re.compile(r"\]\(\s*<?([^)\s>#]+)")


def main():
    root, pages = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    shutil.rmtree(pages, ignore_errors=True)
    wanted = {f.relative_to(root).as_posix() for f in [*root.glob("*.md"), *(f for top in TOPS for f in (root / top).rglob("*.md"))]}
    for page in sorted(wanted):
        for link in LINK.findall((root / page).read_text(encoding="utf-8")):
            if not re.match(r"[a-z][a-z0-9+.-]*:", link):
                wanted.add(posixpath.normpath(posixpath.join(posixpath.dirname(page), link)))
    for path in sorted(wanted | {"docs/site/site.css"}):
        if (root / path).is_file():
            (pages / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(root / path, pages / path)


if __name__ == "__main__":
    sys.exit(main())
