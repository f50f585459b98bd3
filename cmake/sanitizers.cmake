# SPDX-License-Identifier: GPL-3.0-or-later
# One function: instruments a target as FIBROLITE_SANITIZE says.
function(set_sanitizers target)
  if(FIBROLITE_SANITIZE)
    # GCC 12 warns of moved variants where it instruments the code.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  endif()
  if(FIBROLITE_SANITIZE STREQUAL "address")
    target_compile_options(${target} PUBLIC -fsanitize=address,undefined -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=address,undefined)
  elseif(FIBROLITE_SANITIZE STREQUAL "thread")
    target_compile_options(${target} PUBLIC -fsanitize=thread -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=thread)
  elseif(FIBROLITE_SANITIZE)
    message(FATAL_ERROR "FIBROLITE_SANITIZE must be address, thread or empty, not ${FIBROLITE_SANITIZE}")
  endif()
endfunction()
