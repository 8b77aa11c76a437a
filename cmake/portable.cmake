# Read by cpack before it packs.
if(CPACK_DLM_NATIVE)
  message(FATAL_ERROR "a package must run on every processor: use tools/package, or configure with -DDLM_NATIVE=OFF")
endif()
