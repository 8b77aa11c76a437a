#!/usr/bin/env python3
"""bulk.csv against exact values and against the walls.

    bulk.py exact DLMFD MPIRUN...     without spheres: Newtonian, start-up of Oldroyd-B shear in every direction, thinning; where no file is written
    bulk.py balance DLMFD MPIRUN...   the stress of the box equals that on the walls, with spheres, in every direction, on 1 to 3 ranks
    bulk.py forces DLMFD MPIRUN...    what torques, forces and contact add, against their formulas
    bulk.py dilute DLMFD MPIRUN...    one sphere in a large box: viscosity 1 + 2.5 phi, N1 likewise as h goes to zero
    bulk.py stresslet DLMFD MPIRUN... the columns of trajectory.csv; weakly viscoelastic fluid against Newtonian, where stress acts inside the sphere too
"""
import math
import os

import numpy

import polymer_runs
from polymer_runs import check, launch, run

LAMBDA, SPEED = 0.7, 0.5
WALL = {0: "wall_velocity_x1", 1: "wall_velocity_x2", 2: "wall_velocity"}
SUM = ("solvent", "polymer", "particle", "contact")


def walls(velocity, gradient, share=0.3):
    """Walls on one axis whose velocities differ by the given vector; the lower one takes that share of it, so the mesh has to ride along."""
    periodic = ",".join(str(int(axis != gradient)) for axis in range(3))
    lower, upper = (",".join(str(part * x) for x in velocity) for part in (-share, 1 - share))
    return f" -box_periodic {periodic} -{WALL[gradient]}_lower {lower} -{WALL[gradient]}_upper {upper} "


def unit(axis):
    return [float(axis == d) for d in range(3)]


def columns_add_up(bulk):
    """The totals are the sums of their parts."""
    total = sum(bulk[part + "12"] for part in SUM) + bulk["external12"]
    apart = [abs(bulk["stress12"] - total), abs(bulk["viscosity"] * bulk["shear_rate"] - total)]
    apart += [abs(bulk[N] - sum(bulk[part + N] for part in SUM)) for N in ("N1", "N2")]
    return max(column.max() for column in apart) <= 1e-12 * abs(total).max()


def cube(velocity, gradient, extra):
    """A box of edge 1/2 in four cells."""
    return f"-box_size 0.5,0.5,0.5 -grid_resolution 8 -fluid_viscosity 2 -ts_split_scheme strang -ts_dt 0.05 {extra}" + walls(velocity, gradient)


def oldroyd(bulk, rate):
    """Largest difference of start-up shear from eta1 = 2, lambda2 = lambda1/8."""
    s, eta = bulk["time"] / LAMBDA, 2 * 7 / 8
    shear = 2 / 8 * rate + eta * rate * (1 - numpy.exp(-s))
    first = 2 * eta * LAMBDA * rate**2 * (1 - (1 + s) * numpy.exp(-s))
    exact = {"shear_rate": rate, "stress12": shear, "wall12": shear, "N1": first, "N2": 0, "solvent12": rate / 4}
    return max(abs(bulk[name] - value).max() for name, value in exact.items())


def newtonian():
    found = run(cube([SPEED, 0, 0], 2, "-ts_max_steps 2")).bulk()
    error = abs(found["viscosity"] - 2).max() + abs(found["N1"]).max() + abs(found["N2"]).max()
    check(error <= 1e-12 and list(found["step"]) == [1, 2], f"Newtonian: viscosity 2, N1 = N2 = 0, to {error:.0e} (allowed 1e-12); rows of steps {found['step']}")


def startup():
    print("Start-up of shear in Oldroyd-B fluid, strang, t = 0.05 to 1: shear stress, N1, N2, stress on the walls (allowed 1e-11)")
    scene = f"-fluid_model oldroyd_b -fluid_relaxation_time {LAMBDA} -ts_max_time 1"
    for flow, gradient in ((0, 2), (1, 2), (0, 1), (2, 1), (1, 0), (2, 0)):
        for sign in (1, -1):
            found = run(cube([sign * SPEED * x for x in unit(flow)], gradient, scene)).bulk()
            error = oldroyd(found, SPEED / 0.5)
            check(error <= 1e-11 and columns_add_up(found) and len(found["time"]) == 20, f"flow {'-+'[sign > 0]}x{flow + 1}, gradient x{gradient + 1}: {error:.0e}")
    error = oldroyd(run(cube([0.3, -0.4, 0], 2, scene + " -grid_resolution 16"), 2).bulk(), 1.0)
    check(error <= 1e-11, f"flow along 3,-4,0, two ranks: {error:.0e}")


def thinning():
    found = run(cube([SPEED, 0, 0], 2, f"-fluid_model carreau -fluid_carreau_n 0.5 -fluid_relaxation_time {LAMBDA} -ts_max_time 14")).bulk()
    thinned = 2 * (1 + LAMBDA**2) ** -0.25
    last = {name: values[-1] for name, values in found.items()}
    error = max(abs(last["viscosity"] / thinned - 1), abs(last["solvent12"] / (thinned / 8) - 1), abs(last["wall12"] / last["stress12"] - 1))
    check(error <= 1e-6 and columns_add_up(found), f"Carreau, n = 0.5: viscosity {last['viscosity']:.9f}, exact {thinned:.9f}, an eighth the solvent's (within 1e-6)")


def no_shear():
    sheared = cube([SPEED, 0, 0], 2, "")
    for what, options in (("walls at rest", cube([0, 0, 0], 2, "")),
                          ("walls that move together", cube([0, 0, 0], 2, "") + " -wall_velocity_lower 1,0,0 -wall_velocity_upper 1,0,0"),
                          ("walls on two axes", sheared + " -box_periodic 1,0,0 -wall_velocity_x2_lower 0,0.1,0 -wall_velocity_x2_upper 0,0.1,0")):
        path = launch(options + " -ts_max_steps 1")[2]
        check(os.path.exists(os.path.join(path, "summary.json")) and not os.path.exists(os.path.join(path, "bulk.csv")), f"{what}: no bulk.csv")


def exact():
    newtonian()
    startup()
    thinning()
    no_shear()


# Two of the four spheres are so near the walls that their smoothed deltas reach them; the other two touch.
SPHERES = "-grid_resolution 16 -sphere_radius 0.1 -ts_dt 0.02 -ts_max_steps 4 -saddle_rtol 1e-11 -ts_split_scheme strang -box_size 1,1,1"
CENTERS = numpy.array([[0.02, 0.01, 0.385], [-0.1, 0.2, -0.38], [0.45, -0.2, 0.03], [-0.399, -0.22, -0.1]])
POLYMER = " -fluid_model oldroyd_b -fluid_relaxation_time 0.1"


def placed(gradient):
    """The centres with x3 across the gap."""
    return " -sphere_centers " + ",".join(f"{x:.6g}" for x in numpy.roll(CENTERS, gradient - 2, axis=1).ravel())


# name, options, axis across the gap, ranks
BALANCED = (("Newtonian", "", 2, 1), ("no inertia", " -sphere_inertia 0", 1, 2),
            ("collocated volume points", " -pairing_type collocation -pairing_points volume -saddle_rtol 1e-9", 0, 1),
            ("gravity and pressure gradient", " -sphere_density 3 -gravity 5,-3,4 -pressure_gradient 2,1,0", 2, 1),
            ("Oldroyd-B", POLYMER, 2, 1), ("Oldroyd-B, lie, log", POLYMER + " -ts_split_scheme lie -polymer_form log", 0, 3),
            ("explicit", POLYMER + " -polymer_coupling explicit -ts_dt 0.01", 1, 1), ("evolve", POLYMER + " -polymer_inside evolve", 2, 2),
            ("Carreau", POLYMER.replace("oldroyd_b", "carreau") + " -fluid_carreau_n 0.4", 2, 1))


def balance():
    print("Shear stress of the box and of the walls: largest relative difference in four steps (allowed 1e-9)")
    for name, extra, gradient, ranks in BALANCED:
        scene = SPHERES + placed(gradient) + walls(numpy.roll([0.9, -0.3, 0], gradient - 2), gradient) + extra
        found = run(scene, ranks).bulk()
        apart = abs(found["wall12"] / found["stress12"] - 1).max()
        check(apart <= 1e-9 and columns_add_up(found), f"{name}, gap along x{gradient + 1}, ranks {ranks}: {apart:.0e}; stress {found['stress12'][-1]:.6f}, N1 {found['N1'][-1]:.6f}")
        if "inertia" in name:
            check(abs(found["external12"]).max() <= 1e-11, f"  nothing external acts on the spheres, with friction in narrow gaps: {abs(found['external12']).max():.0e} (allowed 1e-11)")
        if ranks > 1:
            one = run(scene).bulk()
            apart = max(abs(found[column] - one[column]).max() for column in found) / abs(one["stress12"]).max()
            check(apart <= 1e-8, f"  and on one rank: {apart:.0e} apart (allowed 1e-8)")


def pushed(extra):
    """The last row of spheres of radius 0.15 in a box of 2 x 1 x 1 without inertia."""
    scene = "-box_size 2,1,1 -grid_resolution 12 -sphere_radius 0.15 -sphere_inertia 0 -ts_dt 1e-9 -ts_max_steps 1 -saddle_rtol 1e-11 "
    return {name: values[-1] for name, values in run(scene + extra + walls([1, 0, 0], 2)).bulk().items()}


def loads():
    """The vorticity axis is -x2, so a torque along x2 turns the sphere with the shear and takes stress away."""
    for what, extra, expected in (("torque 0.3 along x2", "-sphere_centers 0.1,0,0 -sphere_torque 0,0.3,0", -0.3 / 2 / 2),
                                  ("force 0.7 along x1 at x3 = 0.2", "-sphere_centers 0.1,0,0.2 -sphere_force 0.7,0,0", -0.7 * 0.2 / 2), ("free", "-sphere_centers 0.1,0,0", 0.0)):
        found = pushed(extra)["external12"]
        check(abs(found - expected) <= 1e-9, f"{what}: external12 = {found:.12f}, expected {expected:.12f} (within 1e-9)")


def contact():
    """F = s ((D + range - d)/range)^2 along the line of centres, here across the periodic face; against a wall its mirror image with twice the stiffness."""
    gap, reach, stiffness = 0.01, 0.02, 3.0
    distance, force = 0.3 + gap, stiffness * ((reach - gap) / reach) ** 2
    along, first = numpy.array([0.6, 0, 0.8]), numpy.array([0.93, 0.1, -0.05])
    centers = ",".join(f"{x:.12g}" for x in (*first, *(first + distance * along - [2, 0, 0])))
    virial = -force * distance * numpy.outer(along, along) / 2
    expected = {"contact12": virial[0, 2], "contactN1": virial[0, 0] - virial[2, 2], "contactN2": virial[2, 2] - virial[1, 1], "external12": 0.0}
    repulsion = f" -contact_range {reach} -contact_stiffness {stiffness}"
    found = pushed(f"-sphere_centers {centers}" + repulsion)
    apart = max(abs(found[name] - value) for name, value in expected.items())
    check(apart <= 1e-7, f"two spheres in contact: {', '.join(f'{name} {value:.6f}' for name, value in expected.items())}, to {apart:.0e} (allowed 1e-7)")
    lever = 0.15 + gap / 2
    found = pushed(f"-sphere_centers 0,0,{0.5 - lever}" + repulsion)["contactN1"]
    check(abs(found - 2 * force * lever / 2) <= 1e-7, f"a sphere against the wall: contactN1 = {found:.9f}, expected {2 * force * lever / 2:.9f} (within 1e-7)")


def forces():
    loads()
    contact()


def dilute():
    """In this cell, images and walls raise the stresslet of a sphere half way between the walls by the factor 1 + 0.9 a^3 (a fit, tools/calibrate.c)."""
    radius, seen = 0.2, []
    phi, intrinsic = 4 / 3 * math.pi * radius**3 / 8, 2.5 * (1 + 0.9 * radius**3)
    scene = f"-box_size 2,2,2 -sphere_radius {radius} -sphere_centers 0.01,0.02,0 -sphere_inertia 0 -ts_max_steps 0" + walls([2, 0, 0], 2, 0.5)
    for n in (12, 16, 24):
        found = run(scene + f" -grid_resolution {n}").bulk()
        seen.append((found["viscosity"][0] - 1) / phi)
        good = list(found["step"]) == [0] and abs(seen[-1] / intrinsic - 1) <= 0.015
        check(good, f"h = 1/{n}, a = {radius * n:g} h: viscosity 1 + {seen[-1]:.3f} phi, expected {intrinsic:.3f} (within 1.5 %)")
    check(abs(seen[2] / intrinsic - 1) <= 0.005, f"at a = 4.8 h: {100 * (seen[2] / intrinsic - 1):+.2f} % (within 0.5 %)")


def normal_stress():
    """One sphere in slow flow: N1 of the suspension is (1 + 2.5 phi) that of the fluid (Koch and Subramanian 2006); the missing part goes with h, so two meshes tell the limit."""
    radius, wi = 0.2, 0.1
    phi, fluid = 4 / 3 * math.pi * radius**3 / 8, 2 * 7 / 8 * wi
    scene = (f"-box_size 2,2,2 -sphere_radius {radius} -sphere_centers 0,0,0 -sphere_inertia 0 -fluid_model oldroyd_b -fluid_relaxation_time {wi} -fluid_retardation_time {wi / 8}"
             f" -polymer_stress_offset 0 -polymer_inside evolve -ts_dt {wi / 4} -ts_max_time {16 * wi}" + walls([2, 0, 0], 2, 0.5))
    seen = [(run(scene + f" -grid_resolution {n}").bulk()["N1"][-1] / fluid - 1) / phi for n in (12, 16, 24)]
    limit = seen[2] + (seen[2] - seen[1]) * 16 / (24 - 16)
    check(seen[0] < seen[1] < seen[2] and abs(limit / 2.5 - 1) <= 0.12, "slow viscoelastic flow: N1 is (1 + k phi) the fluid's, k = "
          + ", ".join(f"{k:.2f}" for k in seen) + f" at a/h = 2.4, 3.2, 4.8; as h goes to zero {limit:.2f}, exact 2.5 (within 12 %)")


def dilute_suspension():
    dilute()
    normal_stress()


NAMES = ("S11", "S12", "S13", "S22", "S23", "S33")


def shear_columns():
    """A centred sphere in the shear of every plane: one column, which is the particles' stress in bulk.csv; traceless."""
    for flow, gradient in ((0, 2), (1, 2), (0, 1)):
        found = run("-box_size 1,1,1 -grid_resolution 12 -sphere_radius 0.15 -sphere_centers 0,0,0 -sphere_inertia 0 -ts_max_steps 0" + walls(unit(flow), gradient))
        S, name = dict(zip(NAMES, found.rows[0, 0, 18:])), f"S{flow + 1}{gradient + 1}"
        rest = max(abs(value) for column, value in S.items() if column != name)
        check(abs(S[name] / found.bulk()["particle12"][0] - 1) <= 1e-9 and rest <= 0.07 * S[name],
              f"shear in the plane {flow + 1}{gradient + 1}: {name} = {S[name]:.6f} is the particles' stress times the volume; the others are below {rest / S[name]:.0%} of it (allowed 7 %)")
    found = run("-box_size 1,1,1 -grid_resolution 12 -sphere_radius 0.15 -sphere_centers 0.1,0.02,0.3 -sphere_inertia 0 -lubrication false"
                " -ts_max_steps 0" + walls([0.8, 0.6, 0], 2))
    S = dict(zip(NAMES, found.rows[0, 0, 18:]))
    bulk = {name: values[0] for name, values in found.bulk().items()}
    along = 0.64 * S["S11"] + 0.36 * S["S22"] + 0.96 * S["S12"]
    apart = max(abs(0.8 * S["S13"] + 0.6 * S["S23"] - bulk["particle12"]), abs(along - S["S33"] - bulk["particleN1"]), abs(S["S11"] + S["S22"] + S["S33"]))
    check(apart <= 1e-12 and abs(along - S["S33"]) > 1e-5, f"flow along 4,3,0, sphere near a wall: particle12, particleN1 = {along - S['S33']:.6f} and the trace, to {apart:.0e} (allowed 1e-12)")


def small_wi():
    """What is left of the differences is the smeared surface (docs/theory.md, B7); without the stress inside they would be 54, 22 and 27 %."""
    scene = ("-box_size 1,1,1 -grid_resolution 16 -sphere_radius 0.15 -sphere_centers 0.01,0.02,0 -sphere_inertia 0 -saddle_rtol 1e-8 -ts_split_scheme strang"
             + walls([1, 0, 0], 2))
    exact_value = run(scene + " -ts_max_steps 0").rows[-1, 0, 20]
    for name, extra, least in (("default", "", 0.01), ("explicit", " -polymer_coupling explicit -ts_dt 0.006 -ts_max_steps 50", 0.20),
                               ("no offset", " -polymer_stress_offset 0", 0.04), ("explicit, evolve", " -polymer_coupling explicit -polymer_inside evolve -ts_dt 0.006 -ts_max_steps 50", 0.15)):
        found = run(scene + " -fluid_model oldroyd_b -fluid_relaxation_time 0.05 -ts_dt 0.02 -ts_max_steps 20" + extra).rows[-1, 0, 20]
        check(abs(found / exact_value - 1) <= least, f"Wi = 0.05, {name}: S13 = {found:.5f}, Newtonian {exact_value:.5f}, {100 * (found / exact_value - 1):+.1f} % (within {100 * least:g} %)")


def stresslet():
    shear_columns()
    small_wi()


if __name__ == "__main__":
    polymer_runs.main({"exact": exact, "balance": balance, "forces": forces, "dilute": dilute_suspension, "stresslet": stresslet})
