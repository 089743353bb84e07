# Configures small projects with libraries that link each other, one allowed and several forbidden; run as
#   cmake -DLIBRARIES=cmake/libraries.cmake -DGENERATOR=Ninja -DWORK=folder -P forbidden_links.cmake
function(configure NAME EXPECTED)
  set(folder ${WORK}/${NAME})
  file(REMOVE_RECURSE ${folder})
  string(JOIN "\n" text "cmake_minimum_required(VERSION 3.25)" "project(Links LANGUAGES NONE)" "add_library(Eigen3::Eigen INTERFACE IMPORTED)"
    "set(CMAKE_CXX_COMPILE_FEATURES cxx_std_20)" "include(${LIBRARIES})" ${ARGN} "palpate_check_links()" "")
  file(WRITE ${folder}/CMakeLists.txt "${text}")
  execute_process(COMMAND ${CMAKE_COMMAND} -G ${GENERATOR} -S ${folder} -B ${folder}/build RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_VARIABLE out)
  string(REGEX REPLACE "[ \n]+" " " out "${out}")
  if(EXPECTED STREQUAL "fine" AND NOT result EQUAL 0)
    message(FATAL_ERROR "${NAME}: links that are allowed stopped the configuration: ${out}")
  elseif(NOT EXPECTED STREQUAL "fine" AND (result EQUAL 0 OR NOT out MATCHES "${EXPECTED}"))
    message(FATAL_ERROR "${NAME}: expected \"${EXPECTED}\", got: ${out}")
  endif()
  message(STATUS "${NAME}: ${EXPECTED}")
endfunction()

set(common "palpate_library(base LAYER 1)")
configure(downwards fine ${common} "palpate_library(body LAYER 2 DEPENDS Palpate::base)" "palpate_library(player LAYER 3 DEPENDS Palpate::base)"
  "palpate_library(world LAYER 4 DEPENDS Palpate::body Palpate::player)")
configure(client_to_server "palpate_player .layer 3. may not link palpate_body .layer 2." ${common}
  "palpate_library(body LAYER 2 DEPENDS Palpate::base)" "palpate_library(player LAYER 3 DEPENDS Palpate::body)")
# The server comes first, so the client library does not exist yet where the link is written.
configure(server_to_client "palpate_body .layer 2. may not link palpate_player .layer 3." ${common}
  "palpate_library(body LAYER 2 DEPENDS Palpate::base Palpate::player)" "palpate_library(player LAYER 3)")
configure(common_to_server "palpate_port .layer 1. may not link palpate_body .layer 2." "palpate_library(body LAYER 2)"
  "palpate_library(port LAYER 1 PRIVATE Palpate::body)")
configure(client_to_bench "palpate_player .layer 3. may not link palpate_world .layer 4." "palpate_library(player LAYER 3 DEPENDS Palpate::world)"
  "palpate_library(world LAYER 4)")
