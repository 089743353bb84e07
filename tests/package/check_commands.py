"""Whether the commands that manual pages and the service are given are ones that the programs understand.

usage: check_commands.py SOURCES BIN      exit 0 when they are, 1 with a line for each that is not
"""

import pathlib
import re
import subprocess
import sys


def commands(sources):
    """Yields where, program or program and subcommand, and the options that it is given."""
    files = sources / "cmake/package"
    for page in sorted((files / "man").glob("*.h2m")):
        text = page.read_text().replace("\\\\\n", "").replace("\\", "")
        for line in re.findall(r"^palpate-.*--.*", text, re.M):
            words = line.split()
            command = words[:2] if words[0] in ("palpate-lab", "palpate-bridge") else words[:1]
            yield page.name, command, re.findall(r"--[a-z-]+", line)
    default = (files / "server/palpate-server.default").read_text()
    yield "palpate-server.default", ["palpate-server"], re.findall(r"--[a-z-]+", default)


def main(sources, programs):
    faults, count = [], 0
    for where, command, options in commands(pathlib.Path(sources)):
        answer = subprocess.run([pathlib.Path(programs) / command[0], *command[1:], "--help"], capture_output=True, text=True, errors="replace")
        if answer.returncode != 0:
            faults.append(f"{where}: {' '.join(command)} is no command")
        known = set(re.findall(r"--[a-z0-9-]+", answer.stdout))
        faults += [f"{where}: {' '.join(command)} has no {option}" for option in options if option not in known]
        count += len(options)
    if count < 10:
        faults.append(f"only {count} options were found")
    print("\n".join(faults) or f"{count} options, all known")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
