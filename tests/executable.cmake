# SPDX-License-Identifier: Apache-2.0
# cmake -DROOT=<repository> -P tests/executable.cmake
# Fails, naming them, where files that begin with an interpreter's name ("#!") may not be run: documents call them by name.
cmake_policy(VERSION 3.25)

foreach(folder bench examples scenes scripts tests)
  execute_process(COMMAND find ${ROOT}/${folder} -type f ! -perm -u+x -size -1024k -exec grep -lIm1 "\\A#!" -P {} +
    OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE)
  string(APPEND all "${found}")
endforeach()
if(all)
  message(FATAL_ERROR "not executable:\n${all}")
endif()
