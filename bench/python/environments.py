"""Steps a second of palpate.env's environments: one alone, COUNT in threads, and COUNT in a Vector, resets and policy included.

usage: environments.py FOLDER_OF_PYTHON FOLDER_OF_SCENES [COUNT [SECONDS [ROUNDS]]]

The three take turns for ROUNDS rounds, as other programs make all figures smaller; the ratios are those of the medians.
"""

import os
import statistics
import sys
import threading
import time

sys.path.insert(0, sys.argv[1])
import palpate  # noqa: E402  (after the path is set)
import palpate.env  # noqa: E402

count, seconds = int((sys.argv[3:] or [8])[0]), float((sys.argv[4:] or [5])[0])
rounds = int((sys.argv[5:] or [3])[0])
scene = palpate.Scene(f"{sys.argv[2]}/touch-cube.json")


def work(until, steps, k):
    env = palpate.env.Press(scene)
    env.action_space.seed(k)
    env.reset(seed=k)
    while time.perf_counter() < until:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        steps[k] += 1
        if terminated or truncated:
            env.reset()


def in_threads(threads):
    steps, until = [0] * threads, time.perf_counter() + seconds
    workers = [threading.Thread(target=work, args=(until, steps, k)) for k in range(threads)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return sum(steps)


def in_vector():
    envs, steps, until = palpate.env.Vector(palpate.env.Press, count, scene=scene), 0, time.perf_counter() + seconds
    envs.action_space.seed(0)
    envs.reset(seed=0)
    while time.perf_counter() < until:
        envs.step(envs.action_space.sample())
        steps += count
    return steps


def measure(name, run):
    load, processor_s, begin = os.getloadavg()[0], time.process_time(), time.perf_counter()
    steps = run()
    wall_s, processor_s = time.perf_counter() - begin, time.process_time() - processor_s
    print(f"{name}: {steps / wall_s:.0f} steps/s, {steps / processor_s:.0f} in a second of processor time; "
          f"{processor_s / wall_s:.2f} of {os.cpu_count()} cores; load before {load:.1f}", flush=True)
    return steps / wall_s


kinds = {"one alone": lambda: in_threads(1), f"{count} in threads": lambda: in_threads(count), f"{count} in a Vector": in_vector}
rates = {name: [] for name in kinds}
for _ in range(rounds):
    for name, run in kinds.items():
        rates[name].append(measure(name, run))
alone = statistics.median(rates["one alone"])
for name in list(kinds)[1:]:
    print(f"{name}: {statistics.median(rates[name]) / alone:.2f} times one alone")
