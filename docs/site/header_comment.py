"""A header for Doxygen: the comment at its top becomes the text of its file, with equations and tables (lines that are indented) as they stand.

usage: header_comment.py HEADER
"""

import pathlib
import re
import sys


def main():
    lines = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8").split("\n")
    end = next((i for i, line in enumerate(lines) if not line.startswith("//")), len(lines))
    inside, said = False, ["/** @file"]
    for line in lines[:end]:
        indented = line.startswith("//   ") or (inside and line == "//")
        if indented != inside:
            said.append("@verbatim" if indented else "@endverbatim")
            inside = indented
        said.append(line[2:] if inside else re.sub(r"([<>#])", r"\\\1", line[2:]))
    said.append("@endverbatim */" if inside else "*/")
    print("\n".join(said + lines[end:]))


if __name__ == "__main__":
    sys.exit(main())
