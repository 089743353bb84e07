"""Steps a second of palpate.env's environments: one alone, then COUNT in threads, resets and policy included.

usage: environments.py FOLDER_OF_PYTHON FOLDER_OF_SCENES [COUNT [SECONDS]]

Prints the load of the machine before each: other programs make both figures smaller.
"""

import os
import sys
import threading
import time

sys.path.insert(0, sys.argv[1])
import palpate  # noqa: E402  (after the path is set)
import palpate.env  # noqa: E402

count, seconds = int((sys.argv[3:] or [8])[0]), float((sys.argv[4:] or [10])[0])
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


def steps_a_second(threads):
    load, steps, processor_s, begin = os.getloadavg()[0], [0] * threads, time.process_time(), time.perf_counter()
    workers = [threading.Thread(target=work, args=(begin + seconds, steps, k)) for k in range(threads)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    wall_s, processor_s = time.perf_counter() - begin, time.process_time() - processor_s
    print(f"{threads} in threads: {sum(steps) / wall_s:.0f} steps/s, {sum(steps) / processor_s:.0f} in a second of processor time; "
          f"{processor_s / wall_s:.2f} of {os.cpu_count()} cores; load before {load:.1f}")
    return sum(steps) / wall_s


alone = steps_a_second(1)
print(f"ratio {steps_a_second(count) / alone:.2f}")
