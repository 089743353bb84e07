"""Every rule of check_docs.py finds a planted breach, with its line, and lets the innocent neighbour pass."""

import pathlib
import tempfile
import unittest

from check_docs import README_WORDS, breaches

DEV = "#!/bin/sh\necho 'usage: ./dev COMMAND'\necho\necho '  demo   all of it'\necho '  mesh SURFACE EDGE MESH.msh'\n"
SERVER = "#!/bin/sh\necho '  --scene FILE   the body'\necho '  --listen HOST:PORT'\n"
LAB = """#!/bin/sh
if [ "$1" = replay ]; then echo '  --scheme NAME'; echo '  --out DIR'; else echo 'Subcommands:'; echo '  replay   a motion'; echo '  list     names'; fi
"""


class CheckDocs(unittest.TestCase):
    def found(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            programs = {"dev": DEV, "bin/palpate-server": SERVER, "bin/palpate-lab": LAB}
            for name, text in {"scenes/cube.json": "{}", "docs/README.md": "# Map\n", **programs, **files}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
                if name in programs:
                    (root / name).chmod(0o755)
            return breaches(root, root / "bin")

    def assert_breach(self, text, line, fault):
        self.assertEqual(self.found({"docs/README.md": text}), [f"docs/README.md:{line}: {fault}"])

    def assert_clean(self, text):
        self.assertEqual(self.found({"docs/README.md": text}), [])

    def test_links(self):
        self.assert_breach("# Map\n\n[a](b.md)\n", 3, "links: b.md leads nowhere")
        self.assert_breach("# Map\n\n![a](images/b.png)\n", 3, "links: images/b.png leads nowhere")
        self.assert_breach("# Map\n[a](#mop)\n", 2, "links: docs/README.md has no heading #mop")
        self.assert_clean("# Map, `here`: a b\n[a](#map-here-a-b) [b](../scenes/cube.json) [c](https://example.org/none.md) `[d](e)`\n")

    def test_pages_out_of_reach(self):
        self.assertEqual(self.found({"docs/a/b.md": "x"}), ["docs/a/b.md:1: reach: no way leads here from docs/README.md"])
        self.assertEqual(self.found({"docs/README.md": "[a](a/b.md)", "docs/a/b.md": "[c](c.md)", "docs/a/c.md": "x"}), [])

    def test_length(self):
        self.assertEqual(self.found({"README.md": "word | " * README_WORDS}), [])
        self.assertEqual(len(self.found({"README.md": "word " * (README_WORDS + 1)})), 1)

    def test_commands(self):
        self.assert_breach("# Map\n\n    ./dev dmo\n", 3, "commands: ./dev has no command dmo")
        self.assert_breach("x\n\n```\nbuild/bin/palpate-server --scne a\n```\n", 4, "commands: palpate-server has no --scne")
        self.assert_breach("x\n\n    palpate-server \\\n      --scne a\n", 3, "commands: palpate-server has no --scne")
        self.assert_breach("see `palpate-lab reply`\n", 1, "commands: palpate-lab has no experiment reply")
        self.assert_breach("see `palpate-lab replay --motion a --out b`\n", 1, "commands: palpate-lab replay has no --motion")
        self.assert_breach("    palpate-server --scene scenes/cub.json | tee a\n", 1, "commands: there is no scenes/cub.json")
        self.assert_clean("see `palpate-lab replay --scheme=port [--out DIR]`\n\n    ./dev demo  # --all\n"
                          "    palpate-server --scene scenes/cube.json && palpate-lab list\n\n`--scne`, `palpate-view --any`, `palpate-lab`\n")
        self.assertEqual(self.found({"CHANGELOG.md": "`./dev gone`"}), [])

    def test_code(self):
        readme = "<!-- a.cpp -->\n```cpp\nint a;\n```\n"
        self.assertEqual(self.found({"README.md": readme, "a.cpp": "int a;\n"}), [])
        self.assertEqual(self.found({"README.md": readme, "a.cpp": "int b;\n"}), ["README.md:2: code: differs from a.cpp"])
        self.assertEqual(self.found({"README.md": readme}), ["README.md:2: code: there is no a.cpp"])
        self.assertEqual(self.found({"README.md": "```cpp\nint a;\n```\n"}),
                         ["README.md:1: code: no comment before it names the file that a test compiles"])


if __name__ == "__main__":
    unittest.main()
