"""Debian's Prometheus scrapes a live server under load: what the dashboard and the alerts ask for is there.

usage: check_scraped.py FOLDER_OF_PROGRAMS ROOT      exit 77 where there is no prometheus

Every expression of docker/monitoring/dashboard.json, with everything chosen, and every rule of alerts.yml is asked of Prometheus and
has to give a series; rules with their comparisons as values (`> bool`), because an alert that is quiet gives none. Grafana itself is
no Debian package: that it draws the dashboard is not tried.
"""

import json
import pathlib
import re
import shutil
import sys
import tempfile
import time
import urllib.parse
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from running import PATIENCE_S, Program, WatchedServer, end, free_port, site_keys

PROMETHEUS = shutil.which("prometheus")
SCRAPED_S, RATE_S = 1, 10


def ask(address, path, **parameters):
    with urllib.request.urlopen(f"http://{address}{path}?{urllib.parse.urlencode(parameters)}", timeout=PATIENCE_S) as answer:
        return json.loads(answer.read())["data"]


def configuration(root, metrics, work):
    """Of docker/monitoring, for this server and more often."""
    text = (root / "docker" / "monitoring" / "prometheus.yml").read_text()
    text = re.sub(r"(scrape|evaluation)_interval: \S+", rf"\1_interval: {SCRAPED_S}s", text)
    text = text.replace("127.0.0.1:9464", metrics).replace("alerts.yml", str((root / "docker" / "monitoring" / "alerts.yml").resolve()))
    file = work / "prometheus.yml"
    file.write_text(text)
    return file


def of_dashboard(root):
    dashboard = json.loads((root / "docker" / "monitoring" / "dashboard.json").read_text())
    for panel in dashboard["panels"]:
        for target in panel["targets"]:
            chosen = target["expr"].replace("$__rate_interval", f"{RATE_S}s").replace("$instance", ".*").replace("$room", ".*")
            assert "$" not in chosen, f"{panel['title']}: {chosen}"
            yield panel["title"], chosen
    for variable in dashboard["templating"]["list"]:
        if variable["type"] == "query":
            metric, label = re.fullmatch(r"label_values\((\w+), (\w+)\)", variable["query"]["query"]).groups()
            yield variable["name"], f"count by ({label}) ({metric})"


def of_alerts(root):
    text = (root / "docker" / "monitoring" / "alerts.yml").read_text()
    for name, expression in re.findall(r"alert: (\w+)\n\s+expr: (.*)", text):
        yield name, re.sub(r"(==|!=|>=|<=|<|>)(?= )", r"\1 bool", re.sub(r"\[\d+m\]", f"[{RATE_S}s]", expression))


def until_series(address, where, expression):
    """Some come with the first event."""
    due = time.monotonic() + 3 * RATE_S
    while not (found := ask(address, "/api/v1/query", query=expression)["result"]):
        assert time.monotonic() < due, f"{where}: no series for {expression}"
        time.sleep(SCRAPED_S)
    return len(found)


def check(programs, root, work):
    site, keys = site_keys(programs, work, "hand")
    with WatchedServer(programs, root / "scenes" / "touch-cube.json", "--keys", site, "--record", work / "session.rec") as server:
        at = f"127.0.0.1:{free_port()}"
        scraper = Program(PROMETHEUS, f"--config.file={configuration(root, server.metrics, work)}", f"--storage.tsdb.path={work / 'tsdb'}",
                          f"--web.listen-address={at}", "--log.level=warn")
        hand = Program(programs / "palpate-client", "--server", server.address, "--key", keys["hand"], "--motion",
                       root / "scenes" / "motions" / "press.csv", "--realtime", "off", "--duration-s", "600")
        with scraper, hand:
            hand.wait_for("^joined")
            time.sleep(2 * RATE_S)
            asked = [*of_dashboard(root), *of_alerts(root)]
            series = sum(until_series(at, where, expression) for where, expression in asked)
            groups = ask(at, "/api/v1/rules")["groups"]
            rules = [rule for group in groups for rule in group["rules"]]
            bad = [rule["name"] for rule in rules if rule["health"] != "ok"]
            assert rules and not bad, f"rules that cannot be evaluated: {bad}"
            firing = [rule["name"] for rule in rules if rule["state"] == "firing" and rule["labels"]["severity"] == "critical"]
            assert not firing, f"of a server that is well: {firing}"
            up = ask(at, "/api/v1/query", query="avg_over_time(up[20s])")["result"][0]["value"][1]
        end(server)
    return len(asked), series, len(rules), float(up)


def main():
    if not PROMETHEUS:
        print("there is no prometheus (Debian package prometheus)")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        asked, series, rules, up = check(*map(pathlib.Path, sys.argv[1:3]), pathlib.Path(folder))
    print(f"{asked} expressions give {series} series, {rules} rules can be evaluated, {100 * up:.0f} % of the scrapes came")


if __name__ == "__main__":
    main()
