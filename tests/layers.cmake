# SPDX-License-Identifier: Apache-2.0
# cmake -DROOT=<repository> -P tests/layers.cmake
# Fails, naming file and line, where
# - a library of src/dapple includes one that does not stand above it in the table below (docs/design and CMakeLists.txt say why),
# - a library's include does not begin with dapple/, so that the rule above could not see what it names,
# - a source does not begin with the SPDX line.
cmake_policy(VERSION 3.25)

set(libraries base numeric image denoise scenefile geom trace shading forest scene integrate gi light vegetation path distribution build render)
set(strangers gi forest)  # neither may include the other, whatever their order
set(spdx "SPDX-License-Identifier: Apache-2.0")

set(violations 0)
macro(violation text)
  message("${text}")
  math(EXPR violations "${violations} + 1")
endmacro()

# Sets ${out} to the 1-based number of the first line of `file` that holds `text`.
function(line_of file text out)
  file(READ ${file} content)
  string(FIND "${content}" "${text}" position)
  string(SUBSTRING "${content}" 0 ${position} before)
  string(REGEX MATCHALL "\n" newlines "${before}")
  list(LENGTH newlines count)
  math(EXPR count "${count} + 1")
  set(${out} ${count} PARENT_SCOPE)
endfunction()

set(checked 0)
file(GLOB folders LIST_DIRECTORIES true RELATIVE ${ROOT}/src/dapple ${ROOT}/src/dapple/*)
foreach(library ${folders})
  list(FIND libraries ${library} rank)
  if(rank EQUAL -1)
    violation("src/dapple/${library}: not a library of tests/layers.cmake")
    continue()
  endif()
  file(GLOB_RECURSE sources ${ROOT}/src/dapple/${library}/*.h ${ROOT}/src/dapple/${library}/*.cpp)
  foreach(source ${sources})
    math(EXPR checked "${checked} + 1")
    file(RELATIVE_PATH name ${ROOT} ${source})
    file(STRINGS ${source} includes REGEX "^[ \t]*#[ \t]*include")
    foreach(include IN LISTS includes)
      if(include MATCHES "[<\"]dapple/([a-z_]+)/")
        set(used ${CMAKE_MATCH_1})
        list(FIND libraries ${used} used_rank)
        if(NOT used STREQUAL library AND used IN_LIST strangers AND library IN_LIST strangers)
          line_of(${source} "${include}" line)
          violation("${name}:${line}: ${library} and ${used} must not name each other")
        elseif(used_rank EQUAL -1 OR used_rank GREATER rank)
          line_of(${source} "${include}" line)
          violation("${name}:${line}: ${library} must not include ${used}, which stands below it")
        endif()
      elseif(include MATCHES "include[ \t]*\"")
        line_of(${source} "${include}" line)
        violation("${name}:${line}: write the include from the root of the sources, \"dapple/...\"")
      endif()
    endforeach()
  endforeach()
endforeach()

file(GLOB_RECURSE sources
  ${ROOT}/src/*.h ${ROOT}/src/*.cpp ${ROOT}/apps/*.h ${ROOT}/apps/*.cpp ${ROOT}/apps/CMakeLists.txt
  ${ROOT}/tests/*.h ${ROOT}/tests/*.cpp ${ROOT}/tests/*.cmake ${ROOT}/tests/*.py ${ROOT}/tests/CMakeLists.txt
  ${ROOT}/bench/*.h ${ROOT}/bench/*.cpp ${ROOT}/bench/*.py ${ROOT}/bench/CMakeLists.txt
  ${ROOT}/cmake/* ${ROOT}/scripts/* ${ROOT}/.ci/*)
foreach(source ${ROOT}/CMakeLists.txt ${sources})
  math(EXPR checked "${checked} + 1")
  file(STRINGS ${source} head LIMIT_COUNT 2)
  list(APPEND head "" "")
  list(GET head 0 first)
  if(first MATCHES "^#!")
    list(GET head 1 first)
  endif()
  if(NOT first MATCHES "^(//|#) ${spdx}$")
    file(RELATIVE_PATH name ${ROOT} ${source})
    violation("${name}:1: does not begin with \"${spdx}\" in a comment")
  endif()
endforeach()

if(violations)
  message(FATAL_ERROR "${violations} violations")
endif()
if(checked LESS 2)
  message(FATAL_ERROR "No sources found under ${ROOT}")
endif()
message("${checked} checks, no violation")
