"""CalculiX itself, on the decks of bench/calculix: its figures are those that stand beside them, and that bodies are compared with.

compare_with_calculix.py CCX FOLDER-OF-DECKS WORK
"""
import os
import pathlib
import re
import subprocess
import sys

CASES = (  # a deck of seconds, and where README.md has its figure
    ("bar", ("0.45", "16", "5", "4"), r"^\| 16 x 5 x 4 \|(?: [\d.]+ \|){2} ([\d.]+) \|", 1.0),
    ("block", ("0.45", "3", "3", "3"), r"^\| 3 x 3 x 3 \| ([\d.]+) \|", 1.0),
    ("cantilever", ("0.4", "32", "2", "4"), r"^\| 32 x 2 x 4 \| ([\d.]+) \|", 1e-6),
    ("glued", ("0.45", "8", "4", "4"), r"8 x 4 x 4 elements ([\d.]+)", 1e-3),
)


def main(ccx, decks, work):
    decks, work = pathlib.Path(decks), pathlib.Path(work)
    work.mkdir(parents=True, exist_ok=True)
    readme = (decks / "README.md").read_text(encoding="utf-8")
    for kind, arguments, row, unit in CASES:
        deck = subprocess.run([sys.executable, "-B", decks / "deck.py", kind, *arguments], capture_output=True, text=True, check=True)
        (work / f"{kind}.inp").write_text(deck.stdout, encoding="ascii")
        subprocess.run([ccx, kind], cwd=work, stdout=subprocess.DEVNULL, check=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
        read = subprocess.run([sys.executable, "-B", decks / "deck.py", "read", work / f"{kind}.dat"], capture_output=True, text=True, check=True)
        found, said = float(read.stdout.split()[0]), unit * float(re.search(row, readme, re.MULTILINE).group(1))
        print(f"{kind}: {found:g}, README.md {said:g}")
        assert abs(found - said) <= 1e-3 * said, f"{kind}: CalculiX gives {found}, README.md says {said}"


if __name__ == "__main__":
    main(*sys.argv[1:])
