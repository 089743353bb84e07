"""Writes docs/reference/command-line.md from what the programs and ./dev say with --help.

usage: command_line.py ROOT PROGRAMS > docs/reference/command-line.md      (./dev docs does this)
       command_line.py ROOT PROGRAMS --check      exit 1 when the page is not what they say now
"""

import difflib
import pathlib
import re
import subprocess
import sys

PAGE = "docs/reference/command-line.md"
PROGRAMS = ("palpate-server", "palpate-client", "palpate-view", "palpate-web", "palpate-bridge", "palpate-relay", "palpate-fidelity", "palpate-key")
KEY_COMMANDS = ("new", "trust", "admit", "show", "issue")
HEAD = """# Command line

`./dev docs` makes this page from the `--help` of the programs; a test compares the two.
Every program has `--version` too.
It exits with 0 when it did what it was asked, with 2 on bad usage or input (one line on stderr: what, where, what was expected),
and with 1 when it failed later.
SIGINT and SIGTERM end it cleanly.
"""


def said(*command, cwd):
    text = subprocess.run([f"./{command[0]}", *command[1:]], cwd=cwd, check=True, capture_output=True, text=True).stdout
    text = text.replace(f"./{command[0]} ", f"{command[0]} ") if command[0] != "dev" else text
    text = "".join(c for c in text if c.isprintable() or c == "\n")  # CLI11 prints the value of an enum as a character
    return "\n".join(line.rstrip() for line in text.strip().split("\n"))


def section(level, name, text):
    return f"\n{'#' * level} {name}\n\n```text\n{text}\n```\n"


def page(root, programs):
    parts = [HEAD, section(2, "dev", said("dev", "help", cwd=root))]
    parts += [section(2, name, said(name, "--help", cwd=programs)) for name in PROGRAMS]
    parts.append(section(3, "palpate-bridge igtl", said("palpate-bridge", "igtl", "--help", cwd=programs)))
    parts += [section(3, f"palpate-key {name}", said("palpate-key", name, "--help", cwd=programs)) for name in KEY_COMMANDS]
    experiments = said("palpate-lab", "list", cwd=programs)
    parts.append(section(2, "palpate-lab", f"usage: palpate-lab EXPERIMENT [OPTIONS]      (palpate-lab list names them)\n\n{experiments}"))
    for line in said("palpate-lab", "--help", cwd=programs).split("\nExample:")[0].split("\n"):
        if (name := re.match(r"  ([a-z][a-z0-9-]*)(\s|$)", line)) and name.group(1) != "list":
            parts.append(section(3, f"palpate-lab {name.group(1)}", said("palpate-lab", name.group(1), "--help", cwd=programs)))
    return "".join(parts)


def main():
    if len(sys.argv) not in (3, 4) or sys.argv[3:] not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    root, programs = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    now = page(root, programs)
    if not sys.argv[3:]:
        print(now, end="")
        return 0
    before = (root / PAGE).read_text()
    difference = list(difflib.unified_diff(before.splitlines(), now.splitlines(), PAGE, "--help", lineterm=""))
    print("\n".join(difference) if difference else f"{PAGE} is what the programs say")
    return 1 if difference else 0


if __name__ == "__main__":
    sys.exit(main())
