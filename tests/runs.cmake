# Tests that run the program or read what it leaves.
find_program(DLM_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)

add_test(NAME badinput COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/badinput/run.py $<TARGET_FILE:dlmfd>
         ${PROJECT_SOURCE_DIR}/docs/options.md ${DLM_MPIRUN})
set_tests_properties(badinput PROPERTIES LABELS badinput PROCESSORS 2 TIMEOUT 900)

foreach(ranks 1 2 3)
  set_tests_properties(unit.fieldsio.${ranks} PROPERTIES FIXTURES_SETUP fieldsio.${ranks})
  add_test(NAME scenes.xdmf.${ranks} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/check_xdmf.py fieldsio_${ranks}/fields.xmf --steps 4)
  set_tests_properties(scenes.xdmf.${ranks} PROPERTIES FIXTURES_REQUIRED fieldsio.${ranks})
endforeach()

# Mutated scenes (tests/fuzz): most through the library, many in one process; some through the program.
add_executable(fuzz_scene fuzz/fuzz_scene.c)
target_link_libraries(fuzz_scene PRIVATE dlmfd_lib)
function(dlm_fuzz name count program_count seed)
  add_test(NAME ${name} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/run.py $<TARGET_FILE:fuzz_scene> $<TARGET_FILE:dlmfd>
           ${PROJECT_SOURCE_DIR}/docs/options.md ${count} ${program_count} ${seed} ${DLM_MPIRUN})
  set_tests_properties(${name} PROPERTIES LABELS badinput PROCESSORS 2 TIMEOUT 3600)
endfunction()

dlm_fuzz(fuzz 2000 20 1)
dlm_fuzz(many_fuzz 20000 200 0)
set_tests_properties(many_fuzz PROPERTIES LABELS "badinput;long")

# A dozen cells of docs/extremes.md.
string(REPLACE ";" " " DLM_MPIRUN_WORDS "${DLM_MPIRUN}")
add_test(NAME scenes.extremes COMMAND ${DLM_PYTHON} -B ${PROJECT_SOURCE_DIR}/tools/extremes --quick --program $<TARGET_FILE:dlmfd> --mpirun ${DLM_MPIRUN_WORDS})
set_tests_properties(scenes.extremes PROPERTIES LABELS scenes PROCESSORS 2 TIMEOUT 900)
