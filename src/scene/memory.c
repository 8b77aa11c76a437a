#include <sys/resource.h>
#include "../../include/private/memory.h"
#if defined(__SANITIZE_ADDRESS__)
size_t __sanitizer_get_current_allocated_bytes(void); /* the header of the sanitizers is not everywhere where they are */
#elif defined(__GLIBC__)
  #include <malloc.h>
#endif

PetscReal DLMMemoryInUse(void)
{
#if defined(__SANITIZE_ADDRESS__)
  return (PetscReal)__sanitizer_get_current_allocated_bytes();
#elif defined(__GLIBC__) && __GLIBC_PREREQ(2, 33)
  const struct mallinfo2 info = mallinfo2();
  return (PetscReal)info.uordblks + (PetscReal)info.hblkhd;
#else
  return DLMMemoryResident();
#endif
}

PetscReal DLMMemoryResident(void)
{
  PetscLogDouble resident = 0.0;

  return PetscMemoryGetCurrentUsage(&resident) ? 0.0 : (PetscReal)resident;
}

void DLMMemoryTrim(void)
{
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
  malloc_trim(0);
#endif
}

PetscReal DLMMemoryPeak(void)
{
  struct rusage usage;

  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * (PetscReal)usage.ru_maxrss;
}
