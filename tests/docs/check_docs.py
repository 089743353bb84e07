"""What the documents say of files, commands and flags is so. Prints FILE:LINE: RULE for every breach.

usage: check_docs.py ROOT [PROGRAMS]      exit 0 when there is none, 1 when there is

links     a relative link leads to a file or folder, and its anchor to a heading there
reach     every page under docs/ can be reached from docs/README.md
length    README.md has at most README_WORDS words, those of its code and tables counted
commands  a command in code that begins with ./dev or a program (PROGRAMS is the folder of the built ones) is one that it has, with
          flags that its --help lists and scene files that are there
code      a block of C++ in README.md or a tutorial is the text of the file that the comment before it names, which a test compiles
"""

import pathlib
import posixpath
import re
import subprocess
import sys

README_WORDS = 700
PAGES = ("*.md", "docs/**/*.md", "bench/**/*.md", "scenes/**/*.md", ".github/**/*.md")
PAST = ("docs/notebook.md", "CHANGELOG.md")  # say what was typed then

FENCE = re.compile(r"^\s*(```+|~~~+)\s*(\S*)")
LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)|(?:src|srcset|href)=\"([^\"]+)\"")
HEADING = re.compile(r"^(#{1,6})\s+(.*?)\s*#*$")
PROGRAM = re.compile(r"^(?:\S*/)?(palpate-(?:server|client|view|web|relay|fidelity|lab|key)|dev)$")
FLAG = re.compile(r"--[a-z][a-z0-9-]*")
NAMED_FILE = re.compile(r"<!--\s*(\S+)\s*-->")


class Page:
    """Lines of a page, told apart: prose with code spans blanked, and code."""

    def __init__(self, text):
        self.text = text
        self.prose, self.code, self.blocks, self.anchors = [], [], [], set()
        fence = block = None
        blank = True
        for number, line in enumerate(text.split("\n"), 1):
            match = FENCE.match(line)
            if fence:
                if match and match.group(1).startswith(fence) and not match.group(2):
                    self.blocks.append(block)
                    fence = None
                else:
                    block[2].append(line)
                    self.code.append((number, line))
            elif match:
                fence, block = match.group(1), (number, match.group(2), [])
            elif line.startswith("    ") and (blank or (self.code and self.code[-1][0] == number - 1)):
                self.code.append((number, line))
            else:
                self.read_prose(number, line)
            blank = not line.strip()

    def read_prose(self, number, line):
        for span in re.findall(r"`([^`]+)`", line):
            self.code.append((number, span))
        self.prose.append((number, re.sub(r"`[^`]*`", "", line)))
        if heading := HEADING.match(line):
            self.add_anchor(heading.group(2))
        for name in re.findall(r"(?:id|name)=\"([^\"]+)\"", line):
            self.anchors.add(name)

    def add_anchor(self, heading):
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        slug = re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")
        anchor, again = slug, 0
        while anchor in self.anchors:
            again += 1
            anchor = f"{slug}-{again}"
        self.anchors.add(anchor)


def words(text):
    return sum(1 for word in text.split() if re.search(r"\w", word))


def read_pages(root):
    files = sorted({f for pattern in PAGES for f in root.glob(pattern)})
    return {f.relative_to(root).as_posix(): Page(f.read_text(encoding="utf-8")) for f in files}


def links_of(path, page):
    """(line, target relative to the root or None for the page itself, anchor) of each relative link."""
    for number, line in page.prose:
        for match in LINK.finditer(line):
            link = match.group(1) or match.group(2)
            if re.match(r"[a-z][a-z0-9+.-]*:", link):
                continue
            target, _, anchor = link.partition("#")
            yield number, link, posixpath.normpath(posixpath.join(posixpath.dirname(path), target)) if target else path, anchor


def check_links(root, pages):
    for path, page in pages.items():
        for number, link, target, anchor in links_of(path, page):
            if not (root / target).exists():
                yield path, number, f"links: {link} leads nowhere"
            elif anchor and target in pages and anchor not in pages[target].anchors:
                yield path, number, f"links: {target} has no heading #{anchor}"


def check_reach(pages):
    seen, todo = set(), ["docs/README.md"]
    while todo:
        path = todo.pop()
        if path in seen or path not in pages:
            continue
        seen.add(path)
        todo += [target for _, _, target, _ in links_of(path, pages[path])]
    for path in pages:
        if path.startswith("docs/") and path not in seen:
            yield path, 1, "reach: no way leads here from docs/README.md"


def check_length(pages):
    if "README.md" in pages and (count := words(pages["README.md"].text)) > README_WORDS:
        yield "README.md", 1, f"length: {count} words; at most {README_WORDS}"


class Programs:
    """What the programs say of themselves, asked once each."""

    def __init__(self, root, folder):
        self.root, self.folder, self.said = root, folder, {}

    def help(self, *command):
        if command not in self.said:
            program = self.root / "dev" if command[0] == "dev" else self.folder and self.folder / command[0]
            if not program or not program.exists():
                self.said[command] = None
            else:
                arguments = ["help"] if command[0] == "dev" else [*command[1:], "--help"]
                run = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60)
                self.said[command] = run.stdout if run.returncode == 0 else ""
        return self.said[command]


def commands_in(page):
    """(line, words) of each command in code; a line that ends in a backslash goes on."""
    begun, text = None, ""
    for number, line in page.code:
        line = re.sub(r"(^|\s)#.*", "", line).strip()
        begun, text = (begun or number), text + " " + line.rstrip("\\")
        if line.endswith("\\"):
            continue
        for part in re.split(r"\s(?:&&|\|\||[|;&])(?:\s|$)", text):
            typed = part.replace("[", " ").replace("]", " ").split()
            while typed and (typed[0] == "$" or re.match(r"[A-Z_]+=", typed[0]) or typed[0] in ("sudo", "env", "time")):
                typed = typed[1:]
            if typed and PROGRAM.match(typed[0]):
                yield begun, typed
        begun, text = None, ""


def check_command(root, programs, typed):
    program = PROGRAM.match(typed[0]).group(1)
    if program == "dev" and typed[0] != "./dev":
        return
    command, rest = (program,), typed[1:]
    while program == "dev" and rest[:1] == ["--no-install"]:
        rest = rest[1:]
    text = programs.help(program)
    if text is None:
        return
    name = rest[0] if rest and re.fullmatch(r"[a-z][a-z0-9-]*", rest[0]) else None
    if program == "dev" and name:
        if not re.search(rf"^  {re.escape(name)}\b", text, re.M):
            yield f"commands: ./dev has no command {name}"
            return
    if program in ("palpate-lab", "palpate-key") and name:
        if not re.search(rf"^\s+{re.escape(name)}\s", text, re.M):
            yield f"commands: {program} has no {'experiment' if program == 'palpate-lab' else 'command'} {name}"
            return
        if name != "list":
            command, text = (program, name), programs.help(program, name)
    if program != "dev":
        known = set(FLAG.findall(text)) | {"--help", "--version"}
        for flag in [f for word in rest for f in FLAG.findall(word) if word.startswith("-")]:
            if flag not in known:
                yield f"commands: {' '.join(command)} has no {flag}"
    for word in rest:
        if re.fullmatch(r"scenes/[\w/.-]+", word) and not (root / word).exists():
            yield f"commands: there is no {word}"


def check_commands(root, programs, pages):
    for path, page in pages.items():
        if path.startswith(PAST):
            continue
        for number, typed in commands_in(page):
            for fault in check_command(root, programs, typed):
                yield path, number, fault


def check_code(root, pages):
    for path, page in pages.items():
        if path != "README.md" and not path.startswith("docs/tutorials/"):
            continue
        lines = page.text.split("\n")
        for number, language, block in page.blocks:
            named = NAMED_FILE.search("\n".join(lines[max(0, number - 3):number - 1]))
            if named and not (root / named.group(1)).is_file():
                yield path, number, f"code: there is no {named.group(1)}"
            elif named and (root / named.group(1)).read_text().strip() != "\n".join(block).strip():
                yield path, number, f"code: differs from {named.group(1)}"
            elif not named and language == "cpp":
                yield path, number, "code: no comment before it names the file that a test compiles"


def breaches(root, folder=None):
    root = pathlib.Path(root).resolve()
    pages, programs = read_pages(root), Programs(root, folder and pathlib.Path(folder))
    found = [*check_links(root, pages), *check_reach(pages), *check_length(pages), *check_commands(root, programs, pages),
             *check_code(root, pages)]
    return [f"{path}:{number}: {fault}" for path, number, fault in sorted(set(found))]


def main():
    if len(sys.argv) not in (2, 3):
        print(__doc__, file=sys.stderr)
        return 2
    found = breaches(*sys.argv[1:])
    print("\n".join(found) if found else "what the documents say is there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
