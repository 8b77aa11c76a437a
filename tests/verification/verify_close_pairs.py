#!/usr/bin/python3
"""Two close spheres and lubrication: tools/two_spheres against published values, and the program's pair against both.

    verify_close_pairs.py SOURCE_DIR dlmfd_close_pairs exact       the series and the committed table
    verify_close_pairs.py SOURCE_DIR dlmfd_close_pairs mobility    the program's relative motions at gaps a/10 and a/100, on two meshes
"""
import csv
import importlib.machinery
import importlib.util
import subprocess
import sys
import numpy as np


def load_tool(path):
    loader = importlib.machinery.SourceFileLoader('two_spheres', path)
    tool = importlib.util.module_from_spec(importlib.util.spec_from_loader('two_spheres', loader))
    loader.exec_module(tool)
    return tool


def series(kind, alpha):
    """Stimson and Jeffery 1926 (two spheres that follow each other); Brenner 1961 (that approach each other; sphere and wall). Force over 6 pi V."""
    n = np.arange(1, 20 + int(30 / alpha))
    k, sinh = 2 * n + 1, np.sinh
    term = {
        'follow': lambda: 1 - (4 * sinh(k * alpha / 2) ** 2 - k ** 2 * sinh(alpha) ** 2) / (2 * sinh(k * alpha) + k * sinh(2 * alpha)),
        'approach': lambda: (4 * np.cosh(k * alpha / 2) ** 2 + k ** 2 * sinh(alpha) ** 2) / (2 * sinh(k * alpha) - k * sinh(2 * alpha)) - 1,
        'wall': lambda: (2 * sinh(k * alpha) + k * sinh(2 * alpha)) / (4 * sinh(k * alpha / 2) ** 2 - k ** 2 * sinh(alpha) ** 2) - 1,
    }[kind]()
    return 4 / 3 * sinh(alpha) * np.sum(n * (n + 1) / ((2 * n - 1) * (2 * n + 3)) * term)


failures = []


def near(name, value, expected, relative):
    bad = not abs(value - expected) <= relative * abs(expected)
    print(f'  {name}: {value:.7g}, expected {expected:.7g} within {100 * relative:g} %{"  FAILS" if bad else ""}')
    if bad:
        failures.append(name)


def check_exact(tool, table):
    for gap in (1, 0.1, 0.02):
        alpha = np.arccosh(1 + gap / 2)
        R, _ = tool.Pair(gap).resistance_along()
        near(f'Stimson and Jeffery, gap {gap}', (R[0, 0] + R[0, 1]) / (6 * np.pi), series('follow', alpha), 1e-6)
        near(f'approach, gap {gap}', (R[0, 0] - R[0, 1]) / (6 * np.pi), series('approach', alpha), 2e-6)
        near(f'Brenner, wall, gap {gap}', tool.wall_row(gap)['XA'], series('wall', np.arccosh(1 + gap)), 2e-6)
    # Goldman, Cox and Brenner 1967: sphere along a wall
    for gap, force, torque, rolling in ((0.5431, 1.5675, 1.4649e-2, 1.0998), (0.1276, 2.1514, 7.3718e-2, 1.3877), (0.005004, 3.7863, 0.34187, 2.5056)):
        row = tool.wall_row(gap)
        for name, value, expected in (('force', row['YA'], force), ('torque', row['YB'] / 2, torque), ('rolling', row['YC'], rolling)):
            near(f'Goldman, Cox and Brenner, {name}, gap {gap}', value, expected, 3e-4)
    # Faxen: far from a wall; Batchelor and Green 1972: a far pair in strain, and the approach of a near one
    near('Faxen, gap 20', tool.wall_row(20)['YA'], 1 / (1 - 9 / 16 / 21 + 1 / 8 / 21 ** 3), 1e-5)
    far = tool.row(8)
    near('far A', far['A'], 5e-3 - 8e-5 + 25e-6, 2e-2)
    near('far B', far['B'], 16 / 3 * 1e-5, 2e-2)
    near('contact 1 - A', (1 - tool.row(0.005)['A']) / 0.005, 4.077, 0.05)
    # both sizes of an unequal pair, seen from either sphere; rotations and translations are reciprocal
    one, other = tool.Pair(0.2, 3.0), tool.Pair(0.2 / 3, 1 / 3)
    near('unequal pair turned round', one.resistance_along()[0][0, 0], 3 * other.resistance_along()[0][1, 1], 1e-6)
    near('reciprocity', one.resistance_across()[0][0, 3], one.resistance_across()[0][3, 0], 1e-6)
    for row in csv.DictReader(open(table)):
        if float(row['gap']) in (1, 0.1, 0.01):
            for key, value in tool.row(float(row['gap'])).items():
                near(f'table, gap {row["gap"]}, {key}', float(row[key]), value, 1e-5)


def check_mobility(tool, program):
    seen = {}  # resistance to approach at a gap of a/10, by a/h
    for lubricated in (False, True):
        command = [program, '-radii', '2.4,3.2', '-gaps', '0.1,0.01', '-places', '1', '-grid_resolution', '16', '-lubrication', str(lubricated).lower()]
        for row in csv.DictReader(subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()):
            exact = tool.row(float(row['gap']))
            if lubricated:
                near(f'along, gap {row["gap"]}', float(row['mobility_along']), exact['mobility_along'], 0.03)
                near(f'across, gap {row["gap"]}', float(row['mobility_across']), exact['mobility_across'], 0.03)
                near(f'approach in shear, gap {row["gap"]}', 1 - float(row['A']), 1 - exact['A'], 0.03)
                if int(row['iterations']) > 8:
                    failures.append('iterations')
            else:
                seen.setdefault(row['a_over_h'], float(row['XA']))
                excess = float(row['mobility_along']) / exact['mobility_along'] - 1
                print(f'  without lubrication the pair at gap {row["gap"]} approaches {100 * excess:.0f} % too fast')
                if excess < 0.5:
                    failures.append('the mesh is expected to miss the lubrication')
    print(f'  without lubrication, resistance to approach at a gap of a/10 by a/h: {seen}')
    if seen['3.2'] < 1.1 * seen['2.4']:
        failures.append('a finer mesh is expected to resolve more of a gap')


def main():
    source, program, what = sys.argv[1:]
    tool = load_tool(source + '/tools/two_spheres')
    if what == 'exact':
        check_exact(tool, source + '/docs/two_spheres.csv')
    else:
        check_mobility(tool, program)
    sys.exit(f'failed: {", ".join(failures)}' if failures else 0)


if __name__ == '__main__':
    main()
