# Writes OUTPUT, a header that holds the commit of the source tree SOURCE, if it differs from what is there. Run at every build (cmake -P), so that
# the program never names an old commit. DLM_COMMIT: twelve digits, "-modified" if tracked files differ from the commit; those that git archive
# left in commit.txt; or "none".
cmake_minimum_required(VERSION 3.25)
set(commit "")
if(EXISTS ${SOURCE}/.git)
  foreach(variable GIT_DIR GIT_WORK_TREE GIT_INDEX_FILE) # set where a hook of git started the build
    unset(ENV{${variable}})
  endforeach()
  execute_process(COMMAND git --no-optional-locks -c safe.directory=* -C ${SOURCE} describe --always --exclude=* --abbrev=12 --dirty=-modified
                  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
else()
  file(READ ${SOURCE}/cmake/commit.txt archived)
  if(archived MATCHES "^[0-9a-f]+")
    string(SUBSTRING "${archived}" 0 12 commit)
  endif()
endif()
if(commit STREQUAL "")
  set(commit none)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#define DLM_COMMIT \"@commit@\"\n" @ONLY) # leaves a file alone that would not change
