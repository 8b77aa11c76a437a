/* The scene: defaults, every key, options files and their order. */
#include "scenetest.h"

static void Defaults(void **state)
{
  DLMScene *s = Make("");
  char      value[32];
  PetscBool given;

  AssertVector(s->box_size, 1, 1, 1);
  assert_true(s->box_periodic[0] && s->box_periodic[1] && !s->box_periodic[2]);
  assert_true(s->grid_resolution == 24 && s->h == 1. / 24);
  assert_true(s->cells[0] == 24 && s->cells[1] == 24 && s->cells[2] == 24);
  assert_int_equal(s->grid_processes[0] + s->grid_processes[1] + s->grid_processes[2], 0);
  for (int d = 0; d < 3; d++) {
    for (int side = 0; side < 2; side++) AssertVector(s->wall_velocity[d][side], 0, 0, 0);
  }
  AssertVector(s->gravity, 0, 0, 0);
  AssertVector(s->pressure_gradient, 0, 0, 0);
  assert_int_equal(s->fluid_model, DLM_FLUID_NEWTONIAN);
  assert_true(s->fluid_density == 1 && s->fluid_viscosity == 1);
  assert_int_equal(s->n_spheres, 0);
  assert_true(s->sphere_inertia);
  assert_int_equal(s->pairing_type, DLM_PAIRING_IMMERSED);
  assert_int_equal(s->pairing_points, DLM_POINTS_SURFACE);
  assert_true(s->pairing_spacing == DLM_AUTO && s->pairing_degree == DLM_AUTO && s->pairing_compliance == DLM_AUTO);
  assert_true(s->pairing_spin_compliance == DLM_AUTO && s->pairing_strain_compliance == DLM_AUTO);
  assert_true(s->pairing_retraction == DLM_AUTO && s->contact_range == DLM_AUTO &&
              s->contact_stiffness == DLM_AUTO);
  assert_true(s->lubrication == DLM_LUBRICATION_AUTO && s->lubrication_range == 0.75);
  assert_true(s->ts_dt == 0.02 && s->ts_max_time == 1);
  assert_true(s->saddle_rtol == 1e-6 && s->saddle_cluster_gap == 2 && s->saddle_cluster_limit == 4000);
  assert_true(s->stokes_block_limit == 1024 && s->progress_every == 5);
  assert_true(s->output_every == 1 && s->output_fields_every == 0);
  assert_string_equal(s->output_dir, "out");
  assert_string_equal(s->source, "");
  OK(PetscOptionsGetString(NULL, NULL, "-ts_dt", value, sizeof(value), &given)); /* as the TS will see it */
  assert_true(given);
  assert_string_equal(value, "0.02");
  OK(PetscOptionsGetString(NULL, NULL, "-ts_max_time", value, sizeof(value), &given));
  assert_string_equal(value, "1");
  OK(PetscOptionsGetString(NULL, NULL, "-ts_max_steps", value, sizeof(value), &given));
  assert_string_equal(value, "1000000000");
  OK(DLMSceneDestroy(&s));
}

static void KeysOfBoxAndFluid(void **state)
{
  DLMScene *s =
      Make("-box_size 2,1.5,0.5 -box_periodic no,0,off -grid_resolution 16 -grid_processes 0,0,0 "
           "-wall_velocity_lower 1,2,0 -wall_velocity_upper -3,4,0 -wall_velocity_x1_lower 0,5,6 "
           "-wall_velocity_x1_upper 0,7,8 -wall_velocity_x2_lower 9,0,10 -wall_velocity_x2_upper 11,0,12 "
           "-gravity -980.665,0,1e-3 -pressure_gradient 1,2,3 -fluid_model newtonian -fluid_density 0.5 "
           "-fluid_viscosity 2");

  AssertVector(s->box_size, 2, 1.5, 0.5);
  assert_true(!s->box_periodic[0] && !s->box_periodic[1] && !s->box_periodic[2]);
  assert_true(s->cells[0] == 32 && s->cells[1] == 24 && s->cells[2] == 8);
  AssertVector(s->wall_velocity[2][0], 1, 2, 0);
  AssertVector(s->wall_velocity[2][1], -3, 4, 0);
  AssertVector(s->wall_velocity[0][0], 0, 5, 6);
  AssertVector(s->wall_velocity[0][1], 0, 7, 8);
  AssertVector(s->wall_velocity[1][0], 9, 0, 10);
  AssertVector(s->wall_velocity[1][1], 11, 0, 12);
  AssertVector(s->gravity, -980.665, 0, 1e-3);
  AssertVector(s->pressure_gradient, 1, 2, 3);
  assert_true(s->fluid_density == 0.5 && s->fluid_viscosity == 2);
  OK(DLMSceneDestroy(&s));
}

static void KeysOfSpheres(void **state)
{
  DLMScene *s =
      Make("-sphere_centers 0.25,0,0,-0.25,0,0.1 -sphere_radius 0.125 -sphere_density 2 -sphere_motion FIXED "
           "-sphere_velocity 1,2,3 -sphere_omega 4,5,6 -sphere_force 7,8,9 -sphere_torque 10,11,12 "
           "-sphere_inertia false -pairing_type collocation -pairing_points volume -pairing_spacing 2 "
           "-pairing_retraction 0.25 -contact_range 0 -contact_stiffness 3 -lubrication true -lubrication_range 0.5");

  assert_int_equal(s->n_spheres, 2);
  AssertVector(s->spheres[0].center, 0.25, 0, 0);
  AssertVector(s->spheres[1].center, -0.25, 0, 0.1);
  for (int i = 0; i < 2; i++) {
    AssertVector(s->spheres[i].velocity, 1, 2, 3);
    AssertVector(s->spheres[i].omega, 4, 5, 6);
    AssertVector(s->spheres[i].force, 7, 8, 9);
    AssertVector(s->spheres[i].torque, 10, 11, 12);
    assert_true(s->spheres[i].radius == 0.125 && s->spheres[i].density == 2);
    assert_int_equal(s->spheres[i].motion, DLM_MOTION_FIXED);
  }
  assert_false(s->sphere_inertia);
  assert_int_equal(s->pairing_type, DLM_PAIRING_COLLOCATION);
  assert_int_equal(s->pairing_points, DLM_POINTS_VOLUME);
  assert_true(s->pairing_spacing == 2 && s->pairing_retraction == 0.25);
  assert_true(s->contact_range == 0 && s->contact_stiffness == 3);
  assert_true(s->lubrication == DLM_LUBRICATION_TRUE && s->lubrication_range == 0.5);
  OK(DLMSceneDestroy(&s));
}

static void KeysOfTheRun(void **state)
{
  DLMScene *s =
      Make("-ts_dt 1e-3 -ts_max_time 7 -ts_max_steps 12 -ts_split_scheme strang -saddle_rtol 1e-9 "
           "-saddle_cluster_gap 0.5 -saddle_cluster_limit 900 -stokes_block_limit 64.5 -output_dir some/where "
           "-output_every 3 -output_fields_every 10 -progress_every 0.5 -sphere_inertia");

  assert_true(s->ts_dt == 1e-3 && s->ts_max_time == 7);
  assert_true(s->saddle_rtol == 1e-9 && s->saddle_cluster_gap == 0.5 && s->saddle_cluster_limit == 900);
  assert_true(s->stokes_block_limit == 64.5 && s->progress_every == 0.5);
  assert_string_equal(s->output_dir, "some/where");
  assert_true(s->output_every == 3 && s->output_fields_every == 10);
  assert_true(s->sphere_inertia); /* a bare flag is true */
  OK(DLMSceneDestroy(&s));
}

static void AssertOption(const char *name, const char *text)
{
  char      value[64];
  PetscBool given;

  OK(PetscOptionsGetString(NULL, NULL, name, value, sizeof(value), &given));
  assert_true(given);
  assert_string_equal(value, text);
}

/* Mesh and step follow the radius, the box and what drives the scene; TS and its scheme see them; a key that is given wins. */
static void PresetsFollowTheSceneAndGivenKeysWin(void **state)
{
  const char *sheared = "-box_size 3,2,1 -wall_velocity_lower -1,0,0 -wall_velocity_upper 1,0,0 -sphere_centers 0,0,0";
  char        line[512];
  DLMScene   *s;
  PetscReal   resolution, dt, last_resolution = 0, last_dt = PETSC_INFINITY;

  for (DLMAccuracy k = DLM_ACCURACY_DRAFT; k <= DLM_ACCURACY_REFERENCE; k++) {
    snprintf(line, sizeof(line), "%s -accuracy %s", sheared, DLMAccuracies[k]);
    s = Make(line);
    OK(DLMScenePresetMesh(s, k, &resolution, &dt));
    assert_true(s->accuracy == k && s->grid_resolution == resolution && s->ts_dt == dt);
    assert_true(resolution > last_resolution && dt < last_dt && s->saddle_rtol <= 1e-3);
    for (int i = 0; i < s->n_preset_keys; i++) assert_true(s->preset_key[i].applied);
    AssertOption("-ts_split_scheme", "strang");
    snprintf(line, sizeof(line), "%.6g", (double)dt);
    AssertOption("-ts_dt", line);
    last_resolution = resolution;
    last_dt         = dt;
    OK(DLMSceneDestroy(&s));
  }
  /* the smallest sphere decides; 5 cells per axis unit and 7.5 along x1 would be odd or broken: up to the next fit */
  WriteFile("two.csv", "x1,x2,x3,radius\n-1,0,0,0.5\n1,0,0,0.4\n");
  s = Make("-box_size 4.5,3,3 -spheres_file @two.csv -gravity 0,0,-18 -sphere_density 2 -fluid_viscosity 2 -accuracy draft");
  assert_true(s->grid_resolution * 1.5 / 2 == round(s->grid_resolution * 1.5 / 2) && s->grid_resolution >= 2.8 / 0.4 && s->grid_resolution <= 2.8 / 0.4 + 4.0 / 3);
  assert_true(fabs(s->ts_dt * (2. / 9 * 18 * 0.5 / 2) - 0.2) < 1e-12); /* radius over Stokes velocity of the larger, faster one */
  OK(DLMSceneDestroy(&s));
  snprintf(line, sizeof(line), "%s -accuracy draft -fluid_model oldroyd_b -fluid_relaxation_time 0.05", sheared);
  s = Make(line);
  assert_true(fabs(s->ts_dt - 0.2 * 0.1) < 1e-15 && s->n_preset_keys == 7); /* twice the relaxation time is shorter than 1/2 */
  OK(DLMSceneDestroy(&s));
  snprintf(line, sizeof(line), "%s -accuracy fine -grid_resolution 16 -ts_dt 0.5 -ts_split_scheme lie -saddle_rtol 0.01 -pairing_type collocation -pairing_points volume", sheared);
  s = Make(line);
  assert_true(s->grid_resolution == 16 && s->ts_dt == 0.5 && s->saddle_rtol == 0.01 && s->pairing_type == DLM_PAIRING_COLLOCATION && s->pairing_points == DLM_POINTS_VOLUME);
  AssertOption("-ts_split_scheme", "lie");
  for (int i = 0; i < s->n_preset_keys; i++) assert_false(s->preset_key[i].applied);
  OK(DLMSceneDestroy(&s));
  for (int off = 0; off < 2; off++) { /* 54 cells along x2 cannot be halved, 60 can */
    snprintf(line, sizeof(line), "-box_size 1,1.5,1 -wall_velocity_upper 1,0,0 -sphere_radius 0.1 -sphere_centers 0,%g,0 -accuracy standard", 0.1 * off);
    s = Make(line);
    assert_true(s->grid_resolution == (off ? 36 : 40) && s->box_mirror == (off ? DLM_MIRROR_NONE : DLM_MIRROR_HALF));
    OK(DLMSceneDestroy(&s));
  }
  s = Make("-ts_dt 0.5 -accuracy fine"); /* without spheres there is no radius */
  assert_true(s->grid_resolution == 24 && s->ts_dt == 0.5);
  OK(DLMSceneDestroy(&s));
}

/* -polymer_inside auto: the fitted flow for one sphere in slow flow, coupled on both sides (docs/theory.md, V8). */
static void TheRuleForCFollowsTheScene(void **state)
{
  static const char *const scene = "-fluid_model oldroyd_b -wall_velocity_lower -1,0,0 -wall_velocity_upper 1,0,0 ";
  static const struct {
    const char *options;
    DLMInside   rule;
  } cases[] = {
    { "-fluid_relaxation_time 0.5 -sphere_centers 0,0,0 -grid_resolution 40", DLM_INSIDE_STOKES }, /* the rate is 2: Wi = 1, a/h = 4 */
    { "-fluid_relaxation_time 0.5 -sphere_centers 0,0,0 -grid_resolution 38", DLM_INSIDE_EXTEND },
    { "-fluid_relaxation_time 0.25 -sphere_centers 0,0,0", DLM_INSIDE_STOKES },
    { "-fluid_relaxation_time 0.51 -sphere_centers 0,0,0 -grid_resolution 100", DLM_INSIDE_EXTEND },
    { "-fluid_relaxation_time 0.25 -sphere_centers 0,0,0,0.3,0,0", DLM_INSIDE_EXTEND },
    { "-fluid_relaxation_time 0.25 -sphere_centers 0,0,0 -polymer_coupling explicit", DLM_INSIDE_EXTEND },
    { "-fluid_relaxation_time 0.25 -sphere_centers 0,0,0 -polymer_inside evolve", DLM_INSIDE_EVOLVE },
    { "-fluid_relaxation_time 2 -sphere_centers 0,0,0 -polymer_inside stokes", DLM_INSIDE_STOKES },
  };

  for (size_t k = 0; k < sizeof(cases) / sizeof(*cases); k++) {
    char      options[512];
    DLMScene *s;
    snprintf(options, sizeof(options), "%s%s", scene, cases[k].options);
    s = Make(options);
    assert_int_equal(s->polymer_inside, cases[k].rule);
    DLMSceneDestroy(&s);
  }
}

static void YamlEqualsPlainEqualsCommandLine(void **state)
{
  static const char *const lines[] = {"@same.yaml", "@same.opts", "@other.yaml",
                                      "-box_size 3,2,1 -box_periodic 1,0,1 -grid_resolution 8 -sphere_radius "
                                      "0.25 -sphere_centers 0.5,0,0,-0.5,0,0.25"};

  WriteFile(
      "same.yaml",
      "# a comment\nbox: {size: [3, 2,1], periodic: [yes, no, true]}\ngrid:\n  resolution: 8 # cells\n"
      "sphere:\n  radius: 0.25\n  centers:\n    - 0.5\n    - 0\n    - 0\n    - -0.5\n    - 0\n    - 0.25\n");
  WriteFile("same.opts",
            "# a comment\n-box_size 3,2,1\n  -box_periodic \"1, 0, 1\" # quoted\n\n-grid_resolution\t8\r\n"
            "-prefix_push sphere_\n-radius 0.25\n-prefix_pop\n-sphere_centers 0.5,0,0,-0.5,0,0.25");
  WriteFile("other.yaml", /* a byte order mark, Windows' ends of lines, a block, quotes, tags, no end of the last line */
            "\xef\xbb\xbf---\r\nbox_size: |\r\n  3,2,1\r\nbox_periodic: '1,0,1'\r\ngrid_resolution: !!int 8\r\nsphere: &s\r\n  radius: \"0.25\"\r\n  centers: "
            "[0.5, 0,\r\n    0, -0.5, 0, 0.25]");
  for (int i = 0; i < 4; i++) {
    DLMScene *s = Make(lines[i]);

    AssertVector(s->box_size, 3, 2, 1);
    assert_true(s->box_periodic[0] && !s->box_periodic[1] && s->box_periodic[2]);
    assert_int_equal(s->cells[0], 24);
    assert_int_equal(s->n_spheres, 2);
    AssertVector(s->spheres[1].center, -0.5, 0, 0.25);
    assert_true(s->spheres[1].radius == 0.25);
    if (i < 3) assert_non_null(strstr(s->source, lines[i] + 1));
    OK(DLMSceneDestroy(&s));
  }
}

static void LaterFilesWinAndTheCommandLineWinsOverAll(void **state)
{
  DLMScene *s;

  WriteFile("a.yaml", "fluid: {viscosity: 2, density: 2}\nts: {dt: 0.5}\n");
  WriteFile("b.opts", "-fluid_density 3\n-ts_dt 0.25\n");
  s = Make("@a.yaml");
  assert_true(s->fluid_viscosity == 2 && s->fluid_density == 2 && s->ts_dt == 0.5);
  OK(DLMSceneDestroy(&s));
  s = Make("@a.yaml -options_file @b.opts");
  assert_true(s->fluid_viscosity == 2 && s->fluid_density == 3 && s->ts_dt == 0.25);
  OK(DLMSceneDestroy(&s));
  s = Make("-options_file @b.opts -options_file @a.yaml");
  assert_true(s->fluid_density == 2 && s->ts_dt == 0.5);
  OK(DLMSceneDestroy(&s));
  s = Make("-ts_dt 0.125 -options_file @a.yaml -options_file @b.opts -fluid_viscosity 5");
  assert_true(s->fluid_viscosity == 5 && s->fluid_density == 3 && s->ts_dt == 0.125);
  OK(DLMSceneDestroy(&s));
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(Defaults),
  cmocka_unit_test(KeysOfBoxAndFluid),
  cmocka_unit_test(KeysOfSpheres),
  cmocka_unit_test(KeysOfTheRun),
  cmocka_unit_test(PresetsFollowTheSceneAndGivenKeysWin),
  cmocka_unit_test(TheRuleForCFollowsTheScene),
  cmocka_unit_test(YamlEqualsPlainEqualsCommandLine),
  cmocka_unit_test(LaterFilesWinAndTheCommandLineWinsOverAll),
};

RUN_IN_A_FOLDER(tests)
