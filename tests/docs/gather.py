import json
import pathlib

print("rtt_ms,jitter_ms,snr_db,p95_rel_error")
for jitter in (0, 10):
    for rtt in (20, 50, 100, 150, 200):
        run = json.loads(pathlib.Path(f"out/mine/{jitter}/{rtt}/summary.json").read_text())
        print(f"{rtt},{jitter},{run['snr_db']:.1f},{run['p95_rel_error']:.3f}")
