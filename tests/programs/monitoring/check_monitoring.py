"""Alerts and dashboard against what they are made for.

usage: check_monitoring.py names FOLDER_OF_PROGRAMS ROOT      every metric and label that they ask for is one that a server has
       check_monitoring.py rules ROOT                         promtool takes the alerts, and they say what they should;
                                                              exit 77 where there is no promtool
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.request

NAME = re.compile(r"\b((?:palpate|process)_[a-z_]+)\b(\{[^}]*\})?")
PROMTOOL = shutil.which("promtool")


def asked_for(root):
    """(where, metric, selector) of every metric in the alerts and the dashboard."""
    alerts = (root / "docker" / "monitoring" / "alerts.yml").read_text()
    for expression in re.findall(r"expr: (.*)", alerts):
        yield from (("alerts.yml", *found.groups()) for found in NAME.finditer(expression))
    dashboard = json.loads((root / "docker" / "monitoring" / "dashboard.json").read_text())
    for panel in dashboard["panels"]:
        for target in panel["targets"]:
            yield from ((panel["title"], *found.groups()) for found in NAME.finditer(target["expr"]))
    for variable in dashboard["templating"]["list"]:
        if variable["type"] == "query":
            yield from ((variable["name"], *found.groups()) for found in NAME.finditer(variable["query"]["query"]))


def served(programs, root, work):
    """The series of a server with keys, as it tells them."""
    key = work / "site.keys"
    public = subprocess.run([programs / "palpate-key", "new", work / "a.key"], check=True, capture_output=True, text=True).stdout.strip()
    for command in (["new", key], ["admit", key, public, "OR 3"]):
        subprocess.run([programs / "palpate-key", *command], check=True, capture_output=True)
    server = subprocess.Popen([programs / "palpate-server", "--scene", root / "scenes" / "touch-cube.json", "--listen", "127.0.0.1:0",
                               "--metrics", "127.0.0.1:0", "--keys", key], stdout=subprocess.PIPE, text=True)
    try:
        address = None
        for line in server.stdout:
            found = re.search(r"metrics at (http://\S+)", line)
            address = address or (found and found.group(1))
            if "integrator" in line:
                break
        while "palpate_build_info" not in (text := urllib.request.urlopen(address, timeout=60).read().decode()):
            pass
        return text
    finally:
        server.kill()
        server.communicate()


def check_names(programs, root):
    with tempfile.TemporaryDirectory() as folder:
        text = served(programs, root, pathlib.Path(folder))
    labels = {}
    for line in text.splitlines():
        if not line.startswith("#"):
            name, of = re.match(r"(\w+)(?:\{(.*)\})?", line).groups()
            labels.setdefault(name, set()).update(re.findall(r'(\w+)="', of or ""))
    asked = list(asked_for(root))
    assert len(asked) > 40, asked
    for where, name, selector in asked:
        assert name in labels, f"{where}: no server has {name}"
        unknown = set(re.findall(r"(\w+)=", selector or "")) - labels[name] - {"job", "instance"}
        assert not unknown, f"{where}: {name} has no label {unknown}"
    documented = set(re.findall(r"`((?:palpate|process)_\w+)", (root / "docs" / "reference" / "operation.md").read_text()))
    families = {line.split()[2] for line in text.splitlines() if line.startswith("# TYPE")}
    assert documented == families, f"docs/reference/operation.md: {documented ^ families}"
    if PROMTOOL:
        done = subprocess.run([PROMTOOL, "check", "metrics"], input=text, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    print(f"{len(asked)} metrics are asked for, and all of them are there")


def check_rules(root):
    if not PROMTOOL:
        print("there is no promtool (Debian package prometheus)")
        sys.exit(77)
    alerts = root / "docker" / "monitoring" / "alerts.yml"
    with tempfile.TemporaryDirectory() as folder:
        test = pathlib.Path(folder) / "alerts_test.yml"
        test.write_text((root / "tests" / "monitoring" / "alerts_test.yml").read_text().replace("ALERTS", str(alerts.absolute())))
        for command in (["check", "rules", alerts], ["check", "config", root / "docker" / "monitoring" / "prometheus.yml"], ["test", "rules", test]):
            done = subprocess.run([PROMTOOL, *command], capture_output=True, text=True)
            assert done.returncode == 0, done.stdout + done.stderr
    print("promtool takes the alerts, and they say what they should")


def main():
    if sys.argv[1] == "names":
        check_names(*map(pathlib.Path, sys.argv[2:4]))
    else:
        check_rules(pathlib.Path(sys.argv[2]))


if __name__ == "__main__":
    main()
