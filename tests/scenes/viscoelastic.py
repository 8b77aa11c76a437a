#!/usr/bin/env python3
"""Viscoelastic flows without spheres against exact solutions.

    viscoelastic.py startup DLMFD MPIRUN...      start-up of homogeneous shear in all six plane pairs; fingerprints of the schemes
    viscoelastic.py poiseuille DLMFD MPIRUN...   planar Poiseuille flow: velocity and C on three meshes
    viscoelastic.py mode DLMFD MPIRUN...         C = I + e sin(k x3): decay by exp(-t/lambda2) where it drives a flow, exp(-t/lambda1) where not
    viscoelastic.py carreau DLMFD MPIRUN...      shear-thinning: n = 1 is Oldroyd-B, n = 0.5 in shear and in Poiseuille flow
"""
import math
import re

import numpy

import polymer_runs
from polymer_runs import ENTRY, XX, XY, XZ, ZZ, Run, check, figures, launch, order, run

LAMBDA, RATE = 0.7, 2.0
WI = LAMBDA * RATE
WALL = {0: "wall_velocity_x1", 1: "wall_velocity_x2", 2: "wall_velocity"}
FORMS = ("factor", "log")
COUPLINGS = ("explicit", "both_sides")


def shear(flow, gradient, rate=RATE, extra=""):
    """Homogeneous shear of a box of edge 1/2 in four cells: walls on the gradient's axis that move along the flow's."""
    speed = [0.25 * rate * (axis == flow) for axis in range(3)]
    periodic = ",".join(str(int(axis != gradient)) for axis in range(3))
    upper, lower = ",".join(map(str, speed)), ",".join(str(-x) for x in speed)
    return (f"-box_size 0.5,0.5,0.5 -grid_resolution 8 -box_periodic {periodic} -{WALL[gradient]}_lower {lower} -{WALL[gradient]}_upper {upper}"
            f" -fluid_model oldroyd_b -fluid_relaxation_time {LAMBDA} -output_fields_every 1000000 {extra}")


def shear_error(found, flow, gradient, expected):
    """Largest difference at any node from a C of three known entries, the others being those of I."""
    exact = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    for (i, j), value in expected.items():
        exact[ENTRY[min(i, j), max(i, j)]] = value
    return abs(found.field("conformation") - exact).max()


def startup_values(flow, gradient, time):
    s = time / LAMBDA
    return {(flow, gradient): WI * (1 - math.exp(-s)), (flow, flow): 1 + 2 * WI**2 * (1 - (1 + s) * math.exp(-s))}


def lie_values(flow, gradient, s):
    """Steady state of the thesis's step: C = q^2 (I + g e_a e_b) C (I + g e_b e_a) + s I."""
    q = 1 / (1 + s / 2)
    g = s * WI * q
    c0 = s / (1 - q * q)
    c_ab = q * q * g * c0 / (1 - q * q)
    return {(gradient, gradient): c0, (flow, gradient): c_ab, (flow, flow): (q * q * (2 * g * c_ab + g * g * c0) + s) / (1 - q * q)}


def startup():
    print("Start-up of shear by strang, all plane pairs: largest difference from the exact C at any node")
    for flow in range(3):
        for gradient in range(3):
            if flow == gradient:
                continue
            for form in FORMS:
                found = run(shear(flow, gradient, extra=f"-ts_split_scheme strang -ts_dt 0.05 -ts_max_time 1 -polymer_form {form}"))
                error = shear_error(found, flow, gradient, startup_values(flow, gradient, 1.0))
                check(error <= 1e-6, f"flow x{flow + 1}, gradient x{gradient + 1}, {form:6}: {error:.1e} (allowed 1e-6)")
    startup_orders()
    fingerprints()


def startup_orders():
    print("Errors of C at t = 1 by dt = 0.1, 0.05, 0.025; strang is exact in homogeneous shear")
    for coupling in COUPLINGS:
        for form in FORMS:
            for scheme in ("lie", "strang"):
                errors = []
                for dt in (0.1, 0.05, 0.025):
                    found = run(shear(0, 2, extra=f"-ts_split_scheme {scheme} -ts_dt {dt} -ts_max_time 1 -polymer_form {form} -polymer_coupling {coupling}"))
                    errors.append(shear_error(found, 0, 2, startup_values(0, 2, 1.0)))
                if scheme == "strang":
                    check(max(errors) <= 1e-10, f"{coupling:10} {form:6} strang: {figures(errors)} (allowed 1e-10)")
                else:
                    check(min(order(errors)) >= 0.9, f"{coupling:10} {form:6} lie: {figures(errors)}, orders {order(errors)[0]:.2f}, {order(errors)[1]:.2f} (at least 0.9)")


def fingerprints():
    print("Steady states of lie: the thesis's step in the factor form, s = dt/lambda1")
    deviations = []
    for s in (0.1, 0.05):
        scheme = f"-ts_split_scheme lie -ts_dt {s * LAMBDA} -ts_max_time {32 * LAMBDA} -polymer_form"
        rest = run(shear(0, 2, 0.0, scheme + " factor")).field("conformation")
        moving = run(shear(0, 2, extra=scheme + " factor"))
        c = moving.field("conformation")[2, 2, 2]
        exact = lie_values(0, 2, s)
        error = shear_error(moving, 0, 2, {**exact, (1, 1): exact[2, 2]})
        check(error <= 1e-9, f"s = {s}: {error:.1e} from the fixed point of the thesis's step (allowed 1e-9)")
        deviations.append([(rest[2, 2, 2, ZZ] - 1) / s, (1 - (c[XX] - c[ZZ]) / (2 * WI**2)) / s, (1 - c[XZ] / WI) / s**2])
        log_rest = abs(run(shear(0, 2, 0.0, scheme + " log")).field("conformation") - [1, 1, 1, 0, 0, 0]).max()
        check(log_rest == 0, f"s = {s}: lie, log, at rest: {log_rest:.1e} from I (allowed 0)")
    for name, expected, coarse, fine in zip(("C at rest: 1 + 3s/4", "N1 low by s/4", "C_13 low by s^2/16"), (3 / 4, 1 / 4, 1 / 16), *deviations):
        limit = 2 * fine - coarse
        check(abs(limit / expected - 1) <= 0.02, f"{name}: coefficients {coarse:.4f}, {fine:.4f}, to s = 0 {limit:.4f}, expected {expected:.4f} within 2 %")


# Half gap 1/2, eta1 = 1: shear rate 1 at the walls, Wi there = lambda1.
G, D, P_LAMBDA = 2.0, 0.5, 0.5


def slit(n, extra):
    return (f"-box_size {4 / n},{4 / n},1 -grid_resolution {n} -pressure_gradient {-G},0,0 -fluid_relaxation_time {P_LAMBDA} -output_fields_every 1000000 " + extra)


def poiseuille():
    """C is of first order at the wall nodes, where the lumped projection of the gradient is one-sided; u and C inside are better."""
    for coupling in COUPLINGS:
        for form in FORMS:
            errors = numpy.array([slit_errors(n, f"-fluid_model oldroyd_b -polymer_coupling {coupling} -ts_split_scheme strang -polymer_form {form} -ts_dt 0.05")
                                  for n in (8, 16, 32)])
            print(f"oldroyd_b, {coupling}, strang, {form}: errors at h = 1/8, 1/16, 1/32")
            for name, values, least in zip(PLACES, errors.T, (1.9, 1.9, 1.9, 1.4, 0.9)):
                exact = max(values) <= 1e-8
                check(exact or min(order(values)) >= least,
                      f"  {name}: {figures(values)}" + (" (exact)" if exact else f", orders {order(values)[0]:.2f}, {order(values)[1]:.2f} (at least {least})"))
    print("lie: C13 of the factor form is low by s^2/16, so u is high by that; C13 of the log form by s/2")
    for model, coupling in (("oldroyd_b", "both_sides"), ("ucm", "both_sides")):
        for form, limit in (("factor", 1e-3), ("log", 0.06)):
            u, c13 = slit_errors(16, f"-fluid_model {model} -polymer_coupling {coupling} -ts_split_scheme lie -polymer_form {form} -ts_dt 0.05")[:2]
            check(max(u, c13) <= limit, f"  {model}, {coupling}, lie, {form}, dt = lambda1/10: u {u:.1e}, C13 inside {c13:.1e} (allowed {limit:g})")


PLACES = ("u                          ", "C13 up to half the gap      ", "C11 up to half the gap      ", "C13, root mean square        ", "C13, C11 at the walls        ")


def slit_errors(n, extra):
    """In the steady state, at PLACES; u over the largest one."""
    found = run(slit(n, extra + " -ts_max_time 12.5"))
    z = numpy.linspace(-D, D, n + 1)
    u, c = found.field("velocity")[1, 1], found.field("conformation")
    if abs(c - c[:1, :1]).max() > 1e-9:
        check(False, f"C varies along the walls by {abs(c - c[:1, :1]).max():.1e}")
    shear_strain = -P_LAMBDA * G * z
    c13, c11 = abs(c[1, 1, :, XZ] - shear_strain), abs(c[1, 1, :, XX] - 1 - 2 * shear_strain**2)
    core = abs(z) < 0.51 * D
    return [abs(u[:, 0] - G * (D * D - z * z) / 2).max() / (G * D * D / 2), c13[core].max(), c11[core].max(), math.sqrt((c13**2).mean()), max(c13[0], c13[-1], c11[0], c11[-1])]


# lambda1 = 1, lambda2 = 1/8; 96 cells a wave, whose own rate of decay is known too.
LAMBDA2, WAVE = 0.125, 96


def amplitudes(plane, number, extra):
    """Times and amplitudes of the mode, over the first."""
    n = WAVE * number
    found = run(f"-box_size {4 / n},{4 / n},1 -box_periodic 1,1,1 -grid_resolution {n} -fluid_model oldroyd_b -polymer_mode_amplitude 0.01 -polymer_mode_plane {plane}"
                f" -polymer_mode_number {number} " + extra)
    sine = numpy.sin(2 * math.pi * number * (numpy.arange(n) / n - 0.5))
    component = {"12": XY, "13": XZ}[plane]
    values = [2 / n * (found.field("conformation", step)[1, 2, :, component] * sine).sum() / 0.01 for step in found.steps()]
    return numpy.array(found.times()), numpy.array(values)


def mesh_decay(coupling, time):
    """What is left of the mode on this mesh without errors of the time step: the projected gradient sees the part c of the viscosity; the rest resists with mu_i(t)."""
    c, t = math.cos(math.pi / WAVE) ** 2, (numpy.arange(2000) + 0.5) * time / 2000
    mu_i = 1 - 0.875 * numpy.exp(-t) if coupling == "both_sides" else 0.125
    return math.exp(-time * numpy.mean(1 + 0.875 * c / (mu_i - (mu_i - 0.125) * c)))


def fitted(coupling, scheme, steps, number=1):
    """Rate of decay over the first two lambda2, times lambda2; error of the amplitude at the end against mesh_decay."""
    t, a = amplitudes("13", number, f"-polymer_coupling {coupling} -ts_split_scheme {scheme} -ts_dt {LAMBDA2 / steps} -ts_max_time {2 * LAMBDA2}"
                      f" -output_fields_every {max(1, steps // 10)}")
    return -numpy.polyfit(t, numpy.log(a), 1)[0] * LAMBDA2, abs(a[-1] / mesh_decay(coupling, t[-1]) - 1)


def explicit_bounds():
    """Near the step that the program warns of decay turns into growth: there under strang, 1.08 (factor) and 1.2 times it (log) under lie."""
    print("Explicit coupling: growth of the wave over 60 steps below and above the step of the warning")
    for scheme, form in (("lie", "factor"), ("lie", "log"), ("strang", "factor"), ("strang", "log")):
        scene = (f"-box_size 0.25,0.25,1 -box_periodic 1,1,1 -grid_resolution 32 -fluid_model oldroyd_b -polymer_mode_amplitude 0.001 -ts_max_time 1e6"
                 f" -polymer_coupling explicit -ts_split_scheme {scheme} -polymer_form {form} -output_fields_every 60 ")
        warning = re.search(r"^dlmfd: warning: -ts_dt 1 is above (\S+),", launch(scene + "-ts_dt 1 -ts_max_steps 0")[1], re.M)
        bound = float(warning.group(1)) if warning else math.nan
        check(warning, f"{scheme:6} {form:6}: warning at dt = lambda1, bound {bound}")
        for part in (0.9, 1.3):
            code, output, path = launch(scene + f"-ts_dt {part * bound} -ts_max_steps 60")
            size = abs(Run(path).field("conformation")[..., XZ]).max() / 0.001 if code == 0 else math.inf
            check((size < 1) == (part < 1) and ("warning" in output) == (part > 1), f"  dt = {part} of the bound: {size:.1e}, {'a' if 'warning' in output else 'no'} warning")


def mode():
    print("Fitted rate of decay times lambda2 - 1; orders of the amplitude at 2 lambda2")
    for coupling, steps in (("explicit", (10, 20, 40)), ("both_sides", (40, 80, 160))):
        for scheme in ("lie", "strang"):
            rates, errors = zip(*(fitted(coupling, scheme, n) for n in steps))
            orders = order(errors)
            least = 1.9 if scheme == "strang" else 0.9
            check(orders[-1] >= least, f"{coupling:10} {scheme:6}, dt = lambda2/{steps}: " + ", ".join(f"{100 * (rate - 1):+.2f} %" for rate in rates) + "; orders "
                  + ", ".join(f"{x:.2f}" for x in orders) + f" (the last at least {least})")
    print("Rate of decay times lambda2, one to three waves")
    for coupling, steps in (("explicit", 10), ("both_sides", 80)):
        for number in (1, 2, 3):
            rate = fitted(coupling, "strang", steps, number)[0]
            check(abs(rate - 1) <= 0.01, f"{coupling:10} strang, dt = lambda2/{steps}, k = {number}: {rate:.4f} (within 1 % of 1)")
    explicit_bounds()
    print("The same in the plane 12, which drives no flow: rate times lambda1")
    for coupling in COUPLINGS:
        for form in FORMS:
            for number in (1, 3):
                t, a = amplitudes("12", number, f"-polymer_coupling {coupling} -polymer_form {form} -ts_split_scheme strang -ts_dt 0.1 -ts_max_time 2 -output_fields_every 20")
                rate = -math.log(a[-1]) / t[-1]
                check(abs(rate - 1) <= 1e-9, f"{coupling:10} {form:6} k = {number}: {rate:.10f} (within 1e-9 of 1)")


def carreau_profile(n, exponent):
    """(z, u) of planar Poiseuille flow: eta1 (1 + (lambda1 q)^2)^((n-1)/2) q = G |z| by Newton's method, u by Gauss's quadrature of q between nodes."""
    def rate(z):
        q = G * z
        for _ in range(60):
            base = 1 + (P_LAMBDA * q) ** 2
            power = base ** ((exponent - 1) / 2)
            slope = power * (1 + (exponent - 1) * (P_LAMBDA * q) ** 2 / base)
            q -= (power * q - G * z) / slope
        return q
    z = numpy.linspace(0, D, n // 2 + 1)
    points, weights = numpy.polynomial.legendre.leggauss(8)
    u = [0.0]
    for lower, upper in zip(z[:0:-1], z[-2::-1]):
        middle, half = (lower + upper) / 2, (lower - upper) / 2
        u.append(u[-1] + sum(w * half * rate(middle + half * x) for x, w in zip(points, weights)))
    return numpy.array(u[::-1])


def thinning_bound():
    """Homogeneous shear with a little noise, lambda1 times the rate 1.4: unstable for n below 1 - (1/8)(1 + 1.4^2)/1.4^2 = 0.811 (docs/theory.md, V6)."""
    for n in (0.75, 0.87):
        scene = (f"-box_size 0.125,0.125,0.5 -grid_resolution 32 -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 -fluid_model carreau -fluid_carreau_n {n}"
                 f" -fluid_relaxation_time {LAMBDA} -polymer_mode_amplitude 1e-6 -polymer_mode_number 2 -ts_split_scheme strang -ts_dt 0.01 -ts_max_time 4 -output_fields_every 200")
        code, output, path = launch(scene)
        warning = re.search(r"^dlmfd: warning: -fluid_carreau_n \S+ thins by more .* above (\S+) shear flow", output, re.M)
        found = Run(path)
        sizes = [abs(found.field("velocity", step)[1, 1, :, 0] - RATE * (numpy.arange(17) / 32 - 0.25)).max() for step in found.steps()[1:]]
        unstable = n < 0.811
        bound = math.sqrt(0.125 / (1 - n - 0.125)) / LAMBDA if n < 0.875 else math.inf
        said = math.isclose(float(warning.group(1)), bound, rel_tol=1e-3) if warning else not math.isfinite(bound)
        check(code == 0 and said and (sizes[1] > 2 * sizes[0]) == unstable and (sizes[1] < 0.1 * sizes[0]) == (not unstable),
              f"n = {n}: noise in the velocity {sizes[0]:.1e} at t = 2, {sizes[1]:.1e} at t = 4; bound said {warning.group(1) if warning else None} (at lambda1 rate = 1.4 unstable below 0.811)")


def carreau():
    """n = 1 is Oldroyd-B; n < 1 in homogeneous shear and in a slit."""
    scene = ("-box_size 1,1,1 -grid_resolution 12 -wall_velocity_lower -0.5,0,0 -wall_velocity_upper 0.5,0,0 -sphere_centers 0.02,0.03,0.11 -sphere_radius 0.15"
             " -ts_dt 0.05 -ts_max_time 0.25 -saddle_rtol 1e-12 -output_fields_every 1000000 -ts_split_scheme strang -polymer_coupling ")
    for coupling in COUPLINGS:
        one, two = run(scene + coupling + " -fluid_model carreau -fluid_carreau_n 1"), run(scene + coupling + " -fluid_model oldroyd_b")
        apart = max(abs(one.rows - two.rows).max(), *(abs(one.field(name) - two.field(name)).max() for name in ("velocity", "conformation")))
        check(apart <= 1e-10, f"{coupling:10} n = 1 and oldroyd_b, a sphere in shear: {apart:.1e} apart (allowed 1e-10)")
    for n in (0.5, 0.3):
        found = run(shear(0, 2, extra=f"-fluid_model carreau -fluid_carreau_n {n} -ts_split_scheme strang -ts_dt 0.1 -ts_max_time 14"))
        thinned = (1 + WI**2) ** ((n - 1) / 2)
        stress = thinned * (RATE / 8 + 7 / 8 * found.field("conformation")[1, 1, 1, XZ] / LAMBDA)
        check(abs(stress / (thinned * RATE) - 1) <= 1e-6 and shear_error(found, 0, 2, startup_values(0, 2, 14)) <= 1e-6,
              f"n = {n}, homogeneous shear: stress {stress:.8f}, eta1(rate) rate = {thinned * RATE:.8f} (within 1e-6)")
    thinning_bound()
    print("Planar Poiseuille flow, n = 0.5: error of u over its largest, h = 1/16, 1/32, 1/64")
    for coupling in COUPLINGS:
        errors = []
        for n in (16, 32, 64):
            found = run(slit(n, f"-fluid_model carreau -fluid_carreau_n 0.5 -polymer_coupling {coupling} -ts_split_scheme strang -ts_dt 0.05 -ts_max_time 25"))
            exact = carreau_profile(n, 0.5)
            errors.append(abs(found.field("velocity")[1, 1, n // 2:, 0] - exact).max() / exact[0])
        check(order(errors)[1] >= 1.9, f"{coupling:10}: {figures(errors)}, orders {order(errors)[0]:.2f}, {order(errors)[1]:.2f} (the last at least 1.9)")


GROUPS = {"startup": startup, "poiseuille": poiseuille, "mode": mode, "carreau": carreau}

if __name__ == "__main__":
    polymer_runs.main(GROUPS)
