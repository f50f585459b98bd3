# SPDX-License-Identifier: GPL-3.0-or-later
# One function: the warnings of our own code. Third-party headers are SYSTEM, so they stay silent.
function(set_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                                           -Wnon-virtual-dtor -Woverloaded-virtual -Wold-style-cast -fno-math-errno)
  if(FIBROLITE_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
