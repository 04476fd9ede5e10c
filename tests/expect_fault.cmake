# SPDX-License-Identifier: Apache-2.0
# For tests of scripts that check a tree: small trees, each with one fault, in the scratch folder WORK.

# expect(text file content [file content ...]): a tree of these files, @ for semicolons, and of those of ${always}, must fail SCRIPT with `text`,
# or pass where text is "ok".
function(expect text)
  file(REMOVE_RECURSE ${WORK})
  set(arguments ${always} ${ARGN})
  while(arguments)
    list(POP_FRONT arguments file content)
    string(REPLACE "@" ";" content "${content}")
    file(WRITE ${WORK}/${file} "${content}")
  endwhile()
  execute_process(COMMAND ${CMAKE_COMMAND} -DROOT=${WORK} -P ${SCRIPT} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(text STREQUAL "ok")
    if(NOT result EQUAL 0)
      message(FATAL_ERROR "A good tree was refused:\n${output}")
    endif()
  elseif(result EQUAL 0)
    message(FATAL_ERROR "Not found: ${text}\n${output}")
  else()
    string(FIND "${output}" "${text}" position)
    if(position EQUAL -1)
      message(FATAL_ERROR "Expected \"${text}\", got:\n${output}")
    endif()
  endif()
endfunction()
