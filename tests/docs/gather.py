import json
import pathlib

print("rtt_ms,jitter_ms,snr_db,p95_rel_error")
for jitter in (0, 10):
    for run in json.loads(pathlib.Path(f"out/mine/{jitter}/summary.json").read_text())["round_trips"]:
        print(f"{run['rtt_ms']:g},{jitter},{run['snr_db']:.1f},{run['p95_rel_error']:.3f}")
