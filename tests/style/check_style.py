"""The house rules that no compiler checks. Prints FILE:LINE: RULE for every breach.

usage: check_style.py ROOT [COMPILE_COMMANDS]      exit 0 when there is none, 1 when there is

layers     includes point one way: common <- {server, client} <- bench <- bindings <- tests; server and client never meet
core       sockets, windows, devices, threads, streams and clocks stay in io/, app/, view/, relay/, in drivers of devices and in the
           programs of bench/
real time  no allocation, lock, log, throw or string in what runs in the 1 kHz tick
alignment  common/base/sort_stably.hpp instead of algorithms of the standard library whose buffers are not aligned for every type
names      a type has a name of its own: two of one name in one program are one to the linker, silently
tests      every tests/**/*.cpp is compiled (COMPILE_COMMANDS is CMake's compile_commands.json); no name has a semicolon, at which
           CTest would cut it in two
words      nothing is left marked as still to be done; the field's terms (docs/glossary.md), not those that the project once had
comments   a comment in a header has a subject: it does not begin with "Of", "That", "What", "Whether", ..., unless it is a question
phrases    turns of phrase at which an English reader stumbles, in documents and comments
"""

import json
import pathlib
import re
import sys

SIDES = {  # who may include whom
    "common": {"common"},
    "server": {"common", "server"},
    "client": {"common", "client"},
    "bench": {"common", "server", "client", "bench"},
    "bindings": {"common", "server", "client", "bench", "bindings"},
    "tests": {"common", "server", "client", "bench", "bindings", "tests"},
}
ALL_SIDES = set(SIDES) | {"schema"}

OUTSIDE_FOLDERS = {"io", "app", "view", "relay", "openhaptics", "forcedimension", "hardware"}  # may meet the operating system
OUTSIDE_PLACES = ("bench/lab/", "bench/output/", "bench/report/", "bench/micro/", "common/command_line/", "tests/")
OUTSIDE_HEADERS = re.compile(
    r"asio|GLFW/|GL/|EGL/|epoxy/|hidapi|spdlog/|thread$|mutex$|shared_mutex$|condition_variable$|iostream$|csignal$|signal\.h$|unistd\.h$|"
    r"pthread\.h$|sched\.h$|poll\.h$|netdb\.h$|fcntl\.h$|ctime$|time\.h$|sys/|netinet/|arpa/|linux/")
FILE_HEADERS = re.compile(r"fstream$|cstdio$|stdio\.h$")
FILE_PLACES = ("common/file/", "server/scene/", "common/motion/", "client/mapping/")  # these read files, at set-up
CLOCKS = re.compile(r"_clock\s*::\s*now\b|\bclock_gettime\b|\bgettimeofday\b|\brandom_device\b|\bstd::time\s*\(")
CLOCK_PLACES = ("bench/",)  # costs are measured there; nothing else depends on them

TEMPORARY_BUFFERS = re.compile(r"\b(stable_sort|stable_partition|inplace_merge|get_temporary_buffer)\b")
TEMPORARY_BUFFERS_PLACE = "common/base/sort_stably.hpp"

REAL_TIME = re.compile(r"client/core/(haptic_tick|button_changes)\.|client/mapping/(mapped_device|force_fade)\.|common/player/(player|part_walls)\.|client/guard/|common/patch/|common/base/(latest_slot|spsc_ring)\.")
REAL_TIME_BANS = [
    (re.compile(r"\bnew\s+[A-Za-z_:(]|\b(malloc|calloc|realloc)\s*\(|\bmake_(unique|shared)\b"), "allocates"),
    (re.compile(r"\bstd::function\b"), "std::function may allocate"),
    (re.compile(r"\bstd::(mutex|recursive_mutex|shared_mutex|lock_guard|unique_lock|scoped_lock|condition_variable)\b"), "locks"),
    (re.compile(r"\bstd::(cout|cerr|clog)\b|\bf?printf\s*\(|\bspdlog::|\bfmt::|<iostream>"), "logs"),
    (re.compile(r"\bthrow\b"), "throws"),
    (re.compile(r"\bstd::(string(?!_view)|to_string|ostringstream|stringstream)\b"), "builds a string"),
]

NAMESPACE = re.compile(r"(?:inline )?namespace(?: (?P<name>[\w:]+))? \{$")
NAMESPACE_END = re.compile(r"\}  // namespace")
TYPE = re.compile(r"(?:struct|class|union|enum class)\s+(?:alignas\(.*?\)+ |\[\[.*?\]\] )?(?P<name>\w+)(?!:)(?: final)?(?: ?:[^;{]*)? \{")

CUT_NAME = re.compile(r'TEST_CASE\(\s*"[^"]*;')
UNFINISHED = re.compile(r"\b(" + "TO" + "DO|FIX" + r"ME)\b")
# Names of our own that gave way to the field's: a pattern, the usual term, and files that may have it still.
OLD_WORDS = [(re.compile(pattern), term, re.compile(allowed) if allowed else None) for pattern, term, allowed in [
    (r"\bcubic\b(?! lattice)|\bcubic_|[Cc]ubic(Terms|Force|Basis|Shapes)", "hyper", r"tests/server/scene/input_error_test\.cpp"),
    (r"\b[Dd]ent(s|ed|_\w*)?\b|\bDents?[A-Z]", "static indentation", None),
    (r"BodyWays|known_ways|expected[_ ]ways", "displacement snapshots, tool prediction", None),
    (r"[Hh]and_?[Ff]utures?\b|affordable_futures|room_futures|\bin[ _]thought\b|step_in_thought", "rollout", None),
    (r"\b[Rr]ehears\w*", "warm-start indentation", None),
    (r"[Rr]emembered_?[Ss]tates?|remembered states", "snapshot cache", None),
    (r"\bcoast(s|ed|ing)\b|kCoastS", "dead reckoning", None),
    (r"\b[Hh]indsight\b", "oracle trajectory", None),
    (r"PortAnswer|port_answers|\banswers (of|to|at) the ports?\b", "port responses", None),
    (r"\bimbalance", "residual force", None),
    (r"\blift_grasp\b|\blifted_1_s2\b|\bstiffness (that )?was lifted\b", "PSD projection", None),
    (r"\bGraded[A-Z]|\bgraded_\w+|\b[Gg]raded (body|one)\b", "locally refined", None),
    (r"NearPart|near_part|\bnear part\b", "nonlinear subdomain", None),
    (r"TurnedDampers|turned_dampers|turned dampers", "lagged damping", None),
    (r"beyond[_ ]linear|BeyondLinear", "nonlinear residual", None),
    (r"(?<!palpate-)\bk?[Bb]ridge[ds]?(_\w*)?\b|\bk\w*Bridge\w*", "prediction horizon",
     r"schema/recording\.fbs|common/record/block_decode\.cpp|docs/reference/recording\.md|bench/lab/session_csv\.cpp"),
    (r"\b[Cc]rews?_?\b|SpinningCrew|spinning_crew|\bemploy\b", "thread pool", None),
    (r"\bdoz(e|es|ed|ing)\b", "idle", None),
    (r"\b[Ss]hades?_?\b", "nodal scalar fields", None),
    (r"\b[Ll]adder", "selection of the integrator", None),
    (r"\bbent (patch|patches|grasp|one|_)|\bbent_\w*|\bBent[A-Z]|\bstraight (patch|one)\b|\bstraight_\w+", "nonlinear, linear",
     r"client/app/report\.cpp"),
    (r"NodePrices|ColumnPrices", "cost model", None),
    (r"\bhand[_ ]aside\b|\bhand 10 um aside\b", "tremor noise floor", None),
    (r"\blives_on\b|\blived_on\b|kLives(On)?Most|let_live_on|\bpatch(es)? (that )?(lives?|lived) on\b", "renew", None),
    (r"palpate_room\b|PALPATE_ROOMS|\bCMake rooms?\b", "library", None),
    (r"\bk(Harmless|Unknown|Seldom|HardlyM?|Dear|Cheap|Little|Clearly)\b", "the quantity that it bounds", None),
]]
OLD_WORDS_PLACES = ("docs/notebook.md", "docs/glossary.md", "CHANGELOG.md", "tests/style/")  # history, the translation, this list

HEADLESS = re.compile(r"(?:Of|That|What|Whether|Where|Who|Whose|How|Which) ")
QUESTION = re.compile(r"[^.?]*\?")

BETWEEN_WORDS = r"\s+(?://+<?[ \t]*)?"  # a phrase may go over the end of a line, in a comment too
PHRASES = [(re.compile(r"\b" + BETWEEN_WORDS.join(phrase.split()), re.I), usual) for phrase, usual in [
    (r"as far as (?:it is|they are)\b", "name the condition"),
    (r"it shall\b", "it must, it is to"),
    (r"in the place of\b", "in place of, instead of"),
    (r"to be had\b", "available"),
    (r"(?:is|are) there to be\b", "is for, exists"),
    (r"dearer\b", "more expensive"),
    (r"truer\b", "more accurate"),
    (r"goes on\b(?! (?:the|top)\b)", "continues"),
    (r"lets? nobody in\b", "refuses new sessions"),
    (r"nobody is let in\b", "new sessions are refused"),
    (r"nobody hears of\b", "without fresh samples, unknown"),
    (r"whoever asks\b", "the client, any peer"),
    (r"forgot the way\b", "the NAT binding expired"),
    (r"mends everything\b", "clears all faults"),
    (r"the wish for scheme\b", "lets the server choose the scheme"),
]]
PHRASES_PLACES = ("docs/notebook.md",)  # history

TEXT = {".cpp", ".hpp", ".c", ".h", ".py", ".cmake", ".txt", ".md", ".fbs", ".json", ".yml", ".yaml", ".sh", ".in"}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
TOKENS = re.compile(
    r'(?P<raw>R"(?P<tag>[^()\s]*)\(.*?\)(?P=tag)")|(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<string>"(?:\\.|[^"\\\n])*")'
    r"|(?P<char>(?<![0-9A-Za-z_])'(?:\\.|[^'\\\n])+')", re.S)


def blank(text, strings):
    """Comments, and with `strings` also literals, made blank; lines stay where they are."""

    def cover(match):
        keep = match.group("comment") is None and not strings
        return match.group(0) if keep else re.sub(r"[^\n]", " ", match.group(0))

    return TOKENS.sub(cover, text)


def check_includes(path, text):
    side = path.split("/")[0]
    free = path.startswith(OUTSIDE_PLACES) or bool(OUTSIDE_FOLDERS & set(path.split("/")[:-1]))
    for number, line in enumerate(blank(text, strings=False).split("\n"), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        quoted, name = match.group(1) == '"', match.group(2)
        target = name.split("/")[0]
        if quoted and ".." in name.split("/"):
            yield number, f'layers: "{name}" is relative; includes start at the root of the repository'
        elif target in ALL_SIDES and "/" in name and target not in SIDES[side]:
            yield number, f"layers: {side} may not include {name}"
        if free or quoted:
            continue
        if OUTSIDE_HEADERS.match(name):
            yield number, f"core: <{name}> belongs into io/, app/, view/ or relay/"
        elif FILE_HEADERS.match(name) and not path.startswith(FILE_PLACES):
            yield number, f"core: <{name}>: files are read by {' and '.join(FILE_PLACES)} only"


def check_code(path, text):
    free = path.startswith(OUTSIDE_PLACES + CLOCK_PLACES) or bool(OUTSIDE_FOLDERS & set(path.split("/")[:-1]))
    real_time = REAL_TIME.match(path)
    for number, line in enumerate(blank(text, strings=True).split("\n"), 1):
        if not free and CLOCKS.search(line):
            yield number, "core: reads a clock or the system's randomness; time is an argument"
        if path != TEMPORARY_BUFFERS_PLACE and (match := TEMPORARY_BUFFERS.search(line)):
            yield number, f"alignment: {match.group(0)} takes memory that is not aligned for every type; {TEMPORARY_BUFFERS_PLACE} does"
        if real_time:
            for ban, what in REAL_TIME_BANS:
                if ban.search(line):
                    yield number, f"real time: {what}"


def named_types(path, text):
    """(line, namespace, name) of every type that other files' types of that name would be one with."""
    inside = []
    for number, line in enumerate(blank(text, strings=False).split("\n"), 1):
        if match := NAMESPACE.match(line.rstrip()):
            inside.append(match.group("name") or path)
        elif match := TYPE.match(line):
            yield number, "::".join(inside), match.group("name")
        elif line.startswith("}") and NAMESPACE_END.match(text.split("\n")[number - 1]) and inside:
            inside.pop()


def check_names(files):
    first = {}
    for path, text in files:
        program = path.rsplit("/", 1)[0] if path.startswith("tests/") else ""
        for number, space, name in named_types(path, text):
            for scope in {program, ""}:
                known = first.get((scope, space, name))
                if known:
                    yield f"{path}:{number}: names: {known} has a type {name} too"
                    break
            else:
                first[program, space, name] = f"{path}:{number}"


def check_words(path, text):
    words = [] if path.startswith(OLD_WORDS_PLACES) else [w for w in OLD_WORDS if not (w[2] and w[2].match(path))]
    for pattern, term, _ in words:
        if match := pattern.search(path):
            yield 1, f"words: the file's name has {match.group(0)}; the usual term: {term}"
    words = [word for word in words if word[0].search(text)]
    for number, line in enumerate(text.split("\n"), 1):
        if match := UNFINISHED.search(line):
            yield number, "words: " + match.group(0)
        for pattern, term, _ in words:
            if match := pattern.search(line):
                yield number, f"words: {match.group(0)}; the usual term: {term}"


def line_comments(text):
    """(line, column, marker, text) of every comment to the end of its line."""
    number, seen = 1, 0
    for match in TOKENS.finditer(text):
        comment, start = match.group("comment"), match.start()
        if not comment or not comment.startswith("//"):
            continue
        number, seen = number + text.count("\n", seen, start), start
        marker = re.match(r"//+<?", comment).group(0)
        yield number, start - text.rfind("\n", 0, start) - 1, marker, comment[len(marker):].strip()


def comment_blocks(text):
    """(first line, text) of every block: comments in one column on lines that follow each other, the later ones alone on theirs."""
    lines, blocks, last = text.split("\n"), [], None
    for number, column, marker, content in line_comments(text):
        alone = not lines[number - 1][:column].strip()
        if alone and last == (number - 1, column, marker):
            blocks[-1][1].append(content)
        else:
            blocks.append((number, [content]))
        last = number, column, marker
    return [(number, " ".join(contents)) for number, contents in blocks]


def check_comments(text):
    for number, content in comment_blocks(text):
        match = HEADLESS.match(content)
        if match and not QUESTION.match(content):
            yield number, f'comments: begins with "{match.group(0).strip()}"; say what the thing is'


def check_phrases(path, text):
    if path.startswith(PHRASES_PLACES):
        return
    if not path.endswith(".md"):
        lines = [""] * (text.count("\n") + 1)
        for number, _, marker, content in line_comments(text):
            lines[number - 1] = f"{marker} {content}"
        text = "\n".join(lines)
    for pattern, usual in PHRASES:
        for match in pattern.finditer(text):
            yield text.count("\n", 0, match.start()) + 1, f"phrases: {' '.join(match.group(0).split())}; say: {usual}"


def check_registered(root, compile_commands):
    compiled = set()
    for entry in json.loads(compile_commands.read_text()):
        file = pathlib.Path(entry["directory"], entry["file"]).resolve()
        compiled.add(str(file))
        if re.fullmatch(r"unity_\d+_cxx\.cxx", file.name):  # several files as one unit
            compiled |= set(re.findall(r'#include "(.+)"', file.read_text()))
    for file in sorted((root / "tests").rglob("*.cpp")):
        if str(file.resolve()) not in compiled:
            yield file.relative_to(root).as_posix(), "tests: no target compiles this file"


def source_files(root):
    for top in [*sorted(ALL_SIDES), "examples", "cmake", "docs", "docker", ".ci"]:
        yield from sorted(f for f in (root / top).rglob("*") if f.is_file())
    yield from sorted(f for f in root.glob("*") if f.is_file())


def breaches(root, compile_commands=None):
    root = pathlib.Path(root)
    found, sources = [], []
    for file in source_files(root):
        path = file.relative_to(root).as_posix()
        if file.suffix not in TEXT and path not in ("dev", ".ci/run") and file.name != "Dockerfile":
            continue
        text = file.read_text(encoding="utf-8")
        faults = list(check_words(path, text))
        if path.startswith("tests/") and path.endswith(".cpp") and (match := CUT_NAME.search(text)):
            faults.append((text.count("\n", 0, match.start()) + 1, "tests: a semicolon in a test's name"))
        if file.suffix in (".md", ".cpp", ".hpp"):
            faults += check_phrases(path, text)
        if file.suffix == ".hpp":
            faults += check_comments(text)
        if file.suffix in (".cpp", ".hpp") and path.split("/")[0] in SIDES:
            faults += [*check_includes(path, text), *check_code(path, text)]
            sources.append((path, text))
        found += [f"{path}:{number}: {fault}" for number, fault in sorted(faults)]
    found += check_names(sources)
    if compile_commands:
        found += [f"{path}:1: {fault}" for path, fault in check_registered(root, pathlib.Path(compile_commands))]
    return found


def main():
    if len(sys.argv) not in (2, 3):
        print(__doc__, file=sys.stderr)
        return 2
    found = breaches(*sys.argv[1:])
    print("\n".join(found) if found else "no breach of the house rules")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
