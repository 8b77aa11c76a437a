#!/usr/bin/python3
"""The pair D = 0.5 of input/pair_two_walls.yaml passes at a gap of 1.06e-3 a: when it crosses, when and where it leaves, how close it comes.

    verify_passing.py dlmfd SOURCE_DIR

Exact: crossing at 10.937, back at abs(x1) = 0.5 at 21.874; the flow is reversible, so a sphere leaves at the x3 at which it came.
"""
import csv
import json
import subprocess
import sys
import tempfile
import numpy as np


def main():
    program, source = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        options = ['-sphere_centers', '-0.5,0,0.05,0.5,0,-0.05', '-ts_max_time', '22.5', '-output_dir', folder, '-progress_every', '60']
        subprocess.run([program, source + '/input/pair_two_walls.yaml'] + options, check=True)
        rows = [row for row in csv.DictReader(open(folder + '/trajectory.csv')) if row['sphere'] == '0']
        gap = json.load(open(folder + '/summary.json'))['smallest_gap'] / 0.1
    time, x1, x3 = (np.array([float(row[key]) for row in rows]) for key in ('time', 'x1', 'x3'))
    values = {'crossing': np.interp(0, x1, time), 'back': np.interp(0.5, x1, time), 'x3 where it leaves': np.interp(0.5, x1, x3), 'smallest gap / a': gap}
    allowed = {'crossing': (10.72, 11.16), 'back': (21.44, 22.31), 'x3 where it leaves': (0.045, 0.055), 'smallest gap / a': (5e-4, 2e-3)}
    bad = [name for name, value in values.items() if not allowed[name][0] <= value <= allowed[name][1]]
    for name, value in values.items():
        print(f'{name}: {value:.6g}, allowed {allowed[name][0]} to {allowed[name][1]}{"  FAILS" if name in bad else ""}')
    sys.exit(1 if bad else 0)


if __name__ == '__main__':
    main()
