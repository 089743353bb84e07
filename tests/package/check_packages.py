"""Whether Debian packages are as they should be; called by ./dev package.

usage: check_packages.py DIR      exit 0 when all .deb in DIR are, 1 with a line for each fault

fields     name, version, architecture, maintainer, dependencies, a synopsis of at most 80 characters
files      root's, readable, none of them writable by others or with special rights, each in one package only; what people look for is there
texts      copyright and changelogs; a manual page for every program, which renders without a warning
service    systemd accepts the unit, its security is scored "OK" or better; what is in /etc is kept by dpkg when an operator edits it
headers    a program that finds the unpacked development files builds and runs
"""

import gzip
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent
PROGRAMS = {  # package: its programs
    "palpate-server": ["palpate-server"],
    "palpate-client": ["palpate-client", "palpate-relay"],
    "palpate-key": ["palpate-key"],
    "palpate-view": ["palpate-view"],
    "palpate-web": ["palpate-bridge", "palpate-web"],
    "palpate-lab": ["palpate-fidelity", "palpate-lab"],
}
HOLDS = {  # package: files beside programs and texts that have to be there
    "palpate-server": ["lib/systemd/system/palpate-server.service", "etc/default/palpate-server", "usr/share/palpate/monitoring/alerts.yml"],
    "palpate-client": ["usr/share/doc/palpate-client/examples/limits.conf", "lib/udev/rules.d/60-palpate.rules", "usr/share/lintian/overrides/palpate-client"],
    "palpate-key": ["usr/share/man/man1/palpate-key-issue.1.gz"],
    "palpate-view": [],
    "palpate-web": [],
    "palpate-lab": ["usr/share/man/man1/palpate-lab-replay.1.gz"],
    "palpate-data": ["usr/share/palpate/scenes/organ.json", "usr/share/palpate/scenes/motions/organ-tour.csv"],
    "palpate-doc": ["usr/share/doc/palpate/README.md", "usr/share/doc/palpate/reference/scenes.md"],
    "python3-palpate": ["usr/lib/python3/dist-packages/palpate/__init__.py", "usr/lib/python3/dist-packages/palpate/__init__.pyi",
                        "usr/share/doc/python3-palpate/examples/press.py"],
    "libpalpate1": ["usr/lib/x86_64-linux-gnu/libpalpate.so.1"],
    "libpalpate-dev": ["usr/include/palpate/common/player/player.hpp", "usr/include/palpate.h",
                       "usr/share/doc/libpalpate-dev/examples/press.c"],
}
OK = 4.0  # exposure as systemd-analyze scores it: 0 is the safest, 10 the least


def run(*command, **options):
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)


def fields(deb):
    text = run("dpkg-deb", "--field", deb, check=True).stdout
    return dict(re.findall(r"^([A-Za-z-]+): ((?:.*)(?:\n .*)*)", text, re.M))


def check_fields(name, control):
    arch_all = name in ("palpate-data", "palpate-doc")
    if (control["Architecture"] == "all") != arch_all:
        yield f"architecture is {control['Architecture']}"
    if not re.fullmatch(r".+ <.+@.+>", control["Maintainer"]):
        yield f"maintainer is {control['Maintainer']}; expected a name and an address"
    if name in PROGRAMS and "libc6 (" not in control.get("Depends", ""):
        yield "the C library is not among the dependencies"
    if name in ("palpate-server", "palpate-lab") and f"palpate-data (= {control['Version']})" not in control.get("Depends", ""):
        yield "does not depend on the scenes of its version"
    if len(control["Description"].split("\n")[0]) > 80:
        yield "the synopsis is longer than 80 characters"


def check_files(deb):
    for line in run("dpkg-deb", "--contents", deb, check=True).stdout.splitlines():
        mode, owner, _, _, _, path = line.split(maxsplit=5)
        program = path.startswith("./usr/bin/") and mode[0] == "-"
        if owner != "root/root":
            yield f"{path} belongs to {owner}"
        wanted = {"d": "drwxr-xr-x", "l": "lrwxrwxrwx"}.get(mode[0], "-rwxr-xr-x" if program else "-rw-r--r--")
        if mode != wanted:
            yield f"{path} has mode {mode}; expected {wanted}"


def check_texts(name, root):
    doc = root / "usr/share/doc" / name
    for text in ("copyright", "changelog.gz", "changelog.Debian.gz"):
        if not (doc / text).is_file():
            yield f"usr/share/doc/{name}/{text} is missing"
    found = sorted(path.name for path in (root / "usr/bin").glob("*"))
    if found != PROGRAMS.get(name, []):
        yield f"programs are {found}"
    for program in found:
        if not (root / f"usr/share/man/man1/{program}.1.gz").is_file():
            yield f"{program} has no manual page"
    for page in sorted(root.glob("usr/share/man/man1/*")):
        warnings = run("man", "--warnings", "--encoding=UTF-8", "--local-file", page, env={**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "80"})
        if warnings.returncode != 0 or warnings.stderr or len(warnings.stdout) < 500:
            yield f"{page.name} does not render: {warnings.stderr.strip() or warnings.stdout.strip()}"
        if re.search(rb"[\x00-\x08\x0e-\x1f]", gzip.decompress(page.read_bytes())):
            yield f"{page.name} has control characters"


def check_service(deb, root):
    edited = set(run("dpkg-deb", "--info", deb, "conffiles").stdout.split())
    in_etc = {"/" + str(path.relative_to(root)) for path in root.glob("etc/**/*") if path.is_file()}
    if edited != in_etc:
        yield f"conffiles are {sorted(edited)}; expected {sorted(in_etc)}"
    units = sorted(root.glob("lib/systemd/system/*"))
    if units and not shutil.which("systemd-analyze"):
        print("check_packages: there is no systemd-analyze: the unit of the service is not checked")
        return
    for unit in units:
        here = root / unit.name  # the same unit, for programs and options where they were unpacked
        here.write_text(re.sub(r"(?<==)/(usr|etc)/", rf"{root}/\1/", unit.read_text()))
        checked = run("systemd-analyze", "verify", "--man=no", here)
        if checked.returncode != 0 or checked.stderr:
            yield f"{unit.name}: {checked.stderr.strip()}"
        exposed = run("systemd-analyze", "security", "--offline=true", "--no-pager", f"--threshold={round(10 * OK)}", here)
        if exposed.returncode != 0:
            yield f"{unit.name}: {exposed.stdout.strip().splitlines()[-1]}"


def check_headers(root, work):
    options = ["-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_PREFIX_PATH={root / 'usr'}"]
    for step in (["cmake", "-S", HERE.parents[1] / "examples/cpp", "-B", work, *options], ["cmake", "--build", work], [work / "consumer", HERE.parents[1] / "scenes" / "organ.json"]):
        done = run(*step)
        if done.returncode != 0:
            yield f"a program that uses it: {(done.stdout + done.stderr).strip()}"
            return


def check(deb, work):
    """Names each fault of a package; returns the files that it has."""
    name = fields(deb)["Package"]
    root = work / name
    run("dpkg-deb", "--extract", deb, root, check=True)
    faults = [*check_fields(name, fields(deb)), *check_files(deb), *check_texts(name, root), *check_service(deb, root)]
    faults += [f"{path} is missing" for path in HOLDS[name] if not (root / path).is_file()]
    if name == "libpalpate-dev":
        faults += check_headers(root, work / "consumer")
    listed = run("dpkg-deb", "--contents", deb, check=True).stdout.splitlines()
    return name, faults, {line.split(maxsplit=5)[5] for line in listed if line[0] != "d"}


def main(folder):
    debs = sorted(pathlib.Path(folder).glob("*.deb"))
    faults, owner = [], {}
    with tempfile.TemporaryDirectory() as work:
        for deb in debs:
            name, found, files = check(deb, pathlib.Path(work).resolve())
            faults += [f"{name}: {fault}" for fault in found]
            faults += [f"{name}: {path} is in {owner[path]} too" for path in files if path in owner]
            owner.update(dict.fromkeys(files, name))
    missing = set(HOLDS) - set(owner.values())
    faults += [f"there is no package {name}" for name in sorted(missing)]
    print("\n".join(f"check_packages: {fault}" for fault in faults) or f"check_packages: {len(debs)} packages, no fault")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
