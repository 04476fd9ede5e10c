# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=<Dapple's build> -DSOURCE=<examples/plugins> -DWORK=<scratch> -P run_plugins.cmake
# Installs Dapple into an empty prefix, builds the example plug-ins against it in a copy of their folder, and renders their scenes
# with the installed program. The pictures must be those of the plug-ins of Dapple's own build, but for rounding: those are
# compiled for another instruction set.
cmake_policy(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
file(GLOB files ${SOURCE}/*)
list(FILTER files EXCLUDE REGEX "/build$")
file(COPY ${files} DESTINATION ${WORK}/plugins)
file(COPY ${files} DESTINATION ${WORK}/own)
file(GLOB libraries ${BUILD}/examples/plugins/*.so)
file(COPY ${libraries} DESTINATION ${WORK}/own/build)
run(${CMAKE_COMMAND} -S ${WORK}/plugins -B ${WORK}/plugins/build -G Ninja -DCMAKE_PREFIX_PATH=${WORK}/prefix)
run(${CMAKE_COMMAND} --build ${WORK}/plugins/build)
foreach(scene toon wet_stone lights)
  foreach(folder plugins own)
    run(${WORK}/prefix/bin/dapple render ${WORK}/${folder}/${scene}.pbrt -o ${WORK}/${folder}/${scene}.exr --shadow-rays 8,2
      --diffuse-rays 8,2 --resolution 120x75 --pixel-samples 8 --strict -q)
  endforeach()
  run(${BUILD}/image_diff ${WORK}/plugins/${scene}.exr ${WORK}/own/${scene}.exr --block 15 --max-mean 0.005 --max-block 0.01)
endforeach()
file(REMOVE_RECURSE ${WORK})
