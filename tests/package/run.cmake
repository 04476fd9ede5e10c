# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=<Dapple's build> -DSOURCE=<this folder> -DSCENE=<cornell.pbrt> -DWORK=<scratch> [-DPYTHON=<interpreter>] -P run.cmake
# Installs Dapple into an empty prefix, then configures, builds and runs the project in this folder against it, and imports the Python
# package where it was built.
cmake_policy(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
file(GLOB_RECURSE leaked RELATIVE ${WORK}/prefix ${WORK}/prefix/*.cmake)
foreach(file ${leaked})
  file(READ ${WORK}/prefix/${file} content)
  string(FIND "${content}" "${BUILD}" position)
  if(NOT position EQUAL -1)
    message(FATAL_ERROR "${file} names the build folder")
  endif()
endforeach()

run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=${WORK}/prefix)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer ${SCENE})
if(NOT output MATCHES "19 shapes, 38 triangles, 3 named materials, 1 area lights")
  message(FATAL_ERROR "The consumer printed:\n${output}")
endif()
# One bounce: the reference's mean (tests/reference/images) is .1147; a tenth of it covers the noise of so few samples.
if(NOT output MATCHES "mean green 0\\.(10[3-9]|11|12[0-6])")
  message(FATAL_ERROR "The consumer's picture is wrong:\n${output}")
endif()
if(NOT output MATCHES "weights [^\n]*/prefix/share/dapple/denoise/rt_hdr_alb_nrm.tza")
  message(FATAL_ERROR "The consumer finds no installed weights:\n${output}")
endif()
message("${output}")
# Without the build tree's weights, which lie above this folder too: the prefix is what is above the program first.
run(${WORK}/prefix/bin/dapple render ${SCENE} -o ${WORK}/image.exr --resolution 16x16 --integrator path --pixel-samples 1 --denoise on)
file(REMOVE_RECURSE ${WORK}/prefix/share/dapple/denoise)
execute_process(COMMAND ${CMAKE_COMMAND} -E env DAPPLE_WEIGHTS=${WORK} ${WORK}/prefix/bin/dapple render ${SCENE} -o ${WORK}/image.exr --denoise on RESULT_VARIABLE result
                OUTPUT_QUIET ERROR_QUIET)
if(NOT result EQUAL 4)
  message(FATAL_ERROR "Missing weights: exit code ${result}, not 4")
endif()
file(GLOB python_folder ${WORK}/prefix/lib/python3*/dist-packages)
if(PYTHON)
  run(${CMAKE_COMMAND} -E env PYTHONPATH=${python_folder} ${PYTHON} -c
    "print((c := __import__('dapple.canopy').canopy).__file__, round(c.LeafAngles('spherical').projection(0.3), 9), __import__('dapple.plot'))")
  if(NOT output MATCHES "prefix/lib/python3.*canopy.* 0\\.5")
    message(FATAL_ERROR "The Python package printed:\n${output}")
  endif()
endif()
file(REMOVE_RECURSE ${WORK})
