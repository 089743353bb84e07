"""Runs `palpate-lab paper --quick` and reads report.html as a browser without a network would."""
import html.parser
import json
import pathlib
import subprocess
import sys

SECTIONS = ["spring1d", "bode", "modes", "chain", "scaling", "haptic", "release", "limits"]
VERDICTS = {"agrees", "differs", "beyond"}


class Page(html.parser.HTMLParser):
    """Collects what a browser would fetch, the anchors, and whether every element that was opened is closed."""

    VOID = {"meta", "img", "br", "link", "hr", "input"}

    def __init__(self):
        super().__init__()
        self.fetched, self.anchors, self.links, self.open, self.pictures, self.text = [], set(), [], [], 0, []

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        if tag not in self.VOID:
            self.open.append(tag)
        for name in ("src", "srcset", "data", "poster"):
            if name in values:
                self.fetched.append(values[name])
        if tag in ("link", "script"):
            self.fetched.append(values.get("href", "inline " + tag))
        if "id" in values:
            self.anchors.add(values["id"])
        if tag == "a":
            self.links.append(values["href"])
        if tag == "img":
            self.pictures += 1
            assert values.get("alt"), "a picture without a text"

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-1:]}"
        self.open.pop()

    def handle_data(self, data):
        self.text.append(data)


def check_summary(summary):
    assert [s["name"] for s in summary["sections"]] == SECTIONS, summary["sections"]
    for section in summary["sections"]:
        where = section["name"]
        assert section["error"] == "", f"{where}: {section['error']}"
        assert section["title"] and section["text"] and section["command"].startswith("palpate-lab paper --only " + where), where
        assert section["findings"] and section["pictures"], f"{where}: nothing found or nothing shown"
        for finding in section["findings"]:
            assert finding["verdict"] in VERDICTS, finding
            assert finding["what"] and finding["ours"], finding
            assert finding["paper"] or finding["verdict"] == "beyond", f"{where}: compared with nothing: {finding}"
            assert finding["reason"] or finding["verdict"] != "differs", f"{where}: differs for no reason: {finding}"
    for verdict in VERDICTS:
        counted = sum(f["verdict"] == verdict for s in summary["sections"] for f in s["findings"])
        assert summary[verdict] == counted, verdict


def check_page(text, summary):
    page = Page()
    page.feed(text)
    assert not page.open, f"left open: {page.open}"
    outside = [u for u in page.fetched if not u.startswith("data:")]
    assert not outside, f"not self-contained: {outside[:3]}"
    assert all(link[1:] in page.anchors for link in page.links), page.links
    shown = "".join(page.text)
    assert "{{" not in shown, "a field of the template was left"
    pictures = [p for s in summary["sections"] for p in s["pictures"]]
    assert page.pictures == len(pictures), f"{page.pictures} of {len(pictures)} pictures"
    for section in summary["sections"]:
        for finding in section["findings"]:
            assert finding["ours"] in shown, finding


def main(lab, out):
    out = pathlib.Path(out)
    subprocess.run([lab, "paper", "--quick", "--out", str(out)], check=True, stdout=subprocess.DEVNULL)
    summary = json.loads((out / "summary.json").read_text())
    check_summary(summary)
    check_page((out / "report.html").read_text(), summary)
    for section in summary["sections"]:
        for picture in section["pictures"]:
            assert (out / picture["file"]).read_text().lstrip().startswith("<?xml"), picture
    print(f"{summary['agrees']} agree, {summary['differs']} differ, {summary['beyond']} beyond")


if __name__ == "__main__":
    main(*sys.argv[1:])
