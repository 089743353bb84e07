"""Runs `palpate-lab replay` on bodies and motions made here and compares its reference force with lattice_reference.py.

usage: compare_with_lab.py PALPATE_LAB WORK_DIR      exit 0 when every relative RMS difference is at most 1 %
"""

import json
import pathlib
import subprocess
import sys

import numpy as np

from lattice_reference import reference

ALLOWED = 0.01


def scene(nodes, node, **lattice):
    spec = {"nodes": nodes, "size_m": [0.1, 0.09, 0.08][: len(nodes)], "density_kg_m3": 1000, "stiffness_n_m": 60,
            "damping_n_s_m": 0.24, "fixed_faces": ["z-" if len(nodes) == 3 else "y-"], **lattice}
    return {"name": "independent", "body": {"lattice": spec}, "tool": {"contact": "attach", "node": node}}


def press(t, depth, side):
    """A press with tremor: starts with zero velocity, bends the body far out of its linear range."""
    ramp = np.sin(np.minimum(t / 0.2, 1) * np.pi / 2) ** 2
    return np.stack([side * np.sin(7 * t) ** 2, 0.3 * side * np.sin(11 * t) ** 2, -depth * ramp + 3e-4 * ramp * np.sin(56 * t)], axis=1)


def cases():
    t = np.arange(0, 0.8005, 0.001)
    coarse = np.arange(0, 0.6005, 0.02)
    yield "cube", scene([4, 4, 4], [1, 1, 3]), t, press(t, 0.010, 0.004)
    yield "layers", scene([5, 4, 4], [2, 2, 3], stiffness_n_m=120, layers=[
        {"below_z_m": 0.05, "stiffness_n_m": 20, "damping_n_s_m": 0.08}]), t, press(t, 0.012, 0.006)
    yield "stiff-coarse-motion", scene([4, 4, 4], [0, 1, 3], stiffness_n_m=800, damping_n_s_m=0.5), coarse, press(coarse, 0.006, 0.003)
    yield "weight", {**scene([4, 3, 4], [2, 1, 3]), "body": {**scene([4, 3, 4], [2, 1, 3])["body"], "gravity_m_s2": [0, 0, -9.81]}}, \
        t, press(t, 0.008, 0.004)
    flat = press(t, 0.008, 0.004)
    yield "flat", scene([6, 5], [3, 4], thickness_m=0.01), t, np.stack([flat[:, 0], flat[:, 2], 0 * t], axis=1)


def run(lab, folder, name, body, t, path):
    folder.mkdir(parents=True, exist_ok=True)
    scene_file, motion_file = folder / "scene.json", folder / "motion.csv"
    scene_file.write_text(json.dumps(body, indent=1))
    nodes, size = body["body"]["lattice"]["nodes"], body["body"]["lattice"]["size_m"]
    rest = np.zeros(3)
    rest[: len(nodes)] = [i * s / (n - 1) for i, n, s in zip(body["tool"]["node"], nodes, size)]
    np.savetxt(motion_file, np.column_stack([t, path + rest]), delimiter=",", header="t_s,x_m,y_m,z_m", comments="", fmt="%.12g")
    subprocess.run([lab, "replay", "--scene", scene_file, "--motion", motion_file, "--scheme", "hold", "--out", folder],
                   check=True, stdout=subprocess.DEVNULL)
    table = np.genfromtxt(folder / "forces.csv", delimiter=",", names=True)
    theirs = np.column_stack([table[c] for c in ("fx_ref_n", "fy_ref_n", "fz_ref_n")])
    ours = reference(scene_file, motion_file)
    expected = np.column_stack([np.interp(table["t_s"], ours[:, 0], ours[:, c]) for c in (1, 2, 3)])
    difference = np.sqrt(((theirs - expected) ** 2).sum() / (expected ** 2).sum())
    print(f"{name}: {len(table)} ticks, force up to {np.abs(expected).max():.2f} N, relative RMS difference {100 * difference:.3f} %")
    if len(table) < 0.9 * len(ours):
        print(f"{name}: only {len(table)} of {len(ours)} ticks are there")
        return False
    return bool(difference <= ALLOWED)


def main():
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    lab, work = sys.argv[1], pathlib.Path(sys.argv[2])
    failed = [name for name, *rest in cases() if not run(lab, work / name, name, *rest)]
    if failed:
        print("differs by more than 1 %:", ", ".join(failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
