/* The facts of `dlmfd -version` and of summary.json. */
#include <dlmversion.h>
#include <dlmbuild.h>
#include <dlmcommit.h>
#include <petscpkg_version.h>
#include <fftw3.h>
#include <hdf5.h>
#include <metis.h>
#include <yaml.h>

static void Petsc(char value[], size_t size)
{
  PetscInt major, minor, subminor, release;

  PetscGetVersionNumber(&major, &minor, &subminor, &release);
  snprintf(value, size, "%d.%d.%d%s", (int)major, (int)minor, (int)subminor, release ? "" : " (development)");
}

/* Such as "Open MPI v4.1.4, package: ..." or "MPICH Version:\t4.0.2\n...": what stands before the first comma or line end. */
static void Mpi(char value[], size_t size)
{
  char text[MPI_MAX_LIBRARY_VERSION_STRING];
  int  length;

  MPI_Get_library_version(text, &length);
  text[strcspn(text, ",\n")] = '\0';
  for (char *p = text; *p; p++) {
    if (*p == '\t') *p = ' ';
  }
  snprintf(value, size, "%s", text);
}

static void Hypre(char value[], size_t size)
{
#if defined(PETSC_HAVE_HYPRE)
  snprintf(value, size, "%d.%d.%d", PETSC_PKG_HYPRE_VERSION_MAJOR, PETSC_PKG_HYPRE_VERSION_MINOR, PETSC_PKG_HYPRE_VERSION_SUBMINOR);
#else
  snprintf(value, size, "none");
#endif
}

static void Hdf5(char value[], size_t size)
{
  unsigned major = 0, minor = 0, release = 0;

  H5get_libversion(&major, &minor, &release);
  snprintf(value, size, "%u.%u.%u", major, minor, release);
}

/* FFTW calls itself "fftw-3.3.10-sse2-avx". */
static void Fftw(char value[], size_t size)
{
  const char *number = fftw_version + strcspn(fftw_version, "0123456789");

  snprintf(value, size, "%.*s", (int)strcspn(number, "-"), number);
}

static void Metis(char value[], size_t size)
{
  snprintf(value, size, "%d.%d.%d", METIS_VER_MAJOR, METIS_VER_MINOR, METIS_VER_SUBMINOR);
}

static void Yaml(char value[], size_t size)
{
  snprintf(value, size, "%s", yaml_get_version_string());
}

static void Scalar(char value[], size_t size)
{
#if defined(PETSC_USE_REAL_DOUBLE)
  const char *precision = "double";
#elif defined(PETSC_USE_REAL_SINGLE)
  const char *precision = "single";
#else
  const char *precision = "extended";
#endif
  snprintf(value, size, "%s, %s precision", PetscDefined(USE_COMPLEX) ? "complex" : "real", precision);
}

static void IndexSize(char value[], size_t size)
{
  snprintf(value, size, "%d bits", (int)(8 * sizeof(PetscInt)));
}

/* A fact is a text or what a function says. */
static const struct {
  const char *name, *text;
  void (*say)(char value[], size_t size);
} facts[] = {
  {"dlmfd",    DLM_VERSION,               NULL     },
  {"commit",   DLM_COMMIT,                NULL     },
  {"build",    DLM_BUILD_TYPE,            NULL     },
  {"native",   DLM_NATIVE ? "yes" : "no", NULL     },
  {"compiler", DLM_COMPILER,              NULL     },
  {"flags",    DLM_FLAGS,                 NULL     },
  {"petsc",    NULL,                      Petsc    },
  {"scalar",   NULL,                      Scalar   },
  {"index",    NULL,                      IndexSize},
  {"mpi",      NULL,                      Mpi      },
  {"hypre",    NULL,                      Hypre    },
  {"hdf5",     NULL,                      Hdf5     },
  {"fftw",     NULL,                      Fftw     },
  {"metis",    NULL,                      Metis    },
  {"yaml",     NULL,                      Yaml     },
};

PetscErrorCode DLMVersionGetFact(PetscInt k, const char **name, char value[], size_t size)
{
  PetscFunctionBeginUser;
  *name = NULL;
  if (k < 0 || k >= (PetscInt)PETSC_STATIC_ARRAY_LENGTH(facts)) PetscFunctionReturn(0);
  *name = facts[k].name;
  if (facts[k].say) facts[k].say(value, size);
  else snprintf(value, size, "%s", facts[k].text);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMVersionPrint(FILE *file)
{
  const char *name;
  char        value[1024];

  PetscFunctionBeginUser;
  for (PetscInt k = 0;; k++) {
    PetscCall(DLMVersionGetFact(k, &name, value, sizeof(value)));
    if (!name) break;
    fprintf(file, "%-9s%s\n", name, value);
  }
  PetscFunctionReturn(0);
}
