# A third of the time of an ordinary file goes into the headers of Eigen and the standard library:
# they are compiled once. GCC takes such a header only with the very flags that it was made with, so
# libraries and programs have one each.
option(SOVO_PRECOMPILE "Compile the headers that most files share only once" ON)

set(SOVO_COMMON_HEADERS
  <Eigen/Dense> <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <functional> <iostream>
  <map> <memory> <mutex> <numbers> <optional> <span> <sstream> <string> <thread> <utility> <vector>)

# sovo_precompile(TARGET [HEADERS...]): a precompiled header of TARGET's own.
function(sovo_precompile target)
  if(SOVO_PRECOMPILE)
    target_precompile_headers(${target} PRIVATE ${SOVO_COMMON_HEADERS} ${ARGN})
  endif()
endfunction()

# sovo_precompile_as(TARGET OTHER): the precompiled header of OTHER, a target with the same flags.
function(sovo_precompile_as target other)
  if(SOVO_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${other})
  endif()
endfunction()
