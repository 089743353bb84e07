# A library is a folder with one job, built as one static library (or interface library when it has only headers).
#
#   palpate_library(NAME LAYER n [LOCAL] [LOOPS] [HOT] [DEPENDS targets...] [PRIVATE targets...])
#
# LOCAL keeps a library out of the installed package. LOOPS: its time goes into loops over numbers. HOT: so does the time of some of its
# files; like libraries with LOOPS it does without the assertions of the standard library.
# LAYER states where the library stands in   schema(0) <- common(1) <- server(2), client(3) <- bench, bindings, tests(4).
# palpate_check_links(), called when every library exists, stops the configuration at a link from a library or program to one of a
# higher layer, or between server and client, whichever of the two was added first.

add_library(palpate_flags INTERFACE)
add_library(Palpate::flags ALIAS palpate_flags)
target_compile_options(palpate_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow
  # GCC 12's own AVX-512 headers, inlined through Eigen, are taken for uses of uninitialised values.
  # At -O3 it also takes a std::string put together with + for an overlapping copy (GCC bug 105651).
  $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
  # In a unit of several files it takes a file's own types for ones from a header.
  $<$<AND:$<COMPILE_LANG_AND_ID:CXX,GNU>,$<BOOL:${PALPATE_UNITY}>>:-Wno-subobject-linkage>
  $<$<BOOL:${PALPATE_WERROR}>:-Werror>)

# AVX-512 is left to kernels that ask for it: GCC 12's headers for it warn through Eigen, and small matrices gain nothing.
if(PALPATE_NATIVE)
  set(PALPATE_NATIVE_FLAGS -march=native)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND PALPATE_NATIVE_FLAGS -mno-avx512f)
  endif()
endif()

# What every translation unit, ours or a user's, must share for the same bits and the same Eigen layout.
add_library(palpate_abi INTERFACE)
add_library(Palpate::abi ALIAS palpate_abi)
target_compile_features(palpate_abi INTERFACE cxx_std_20)
target_compile_options(palpate_abi INTERFACE -ffp-contract=off ${PALPATE_NATIVE_FLAGS})
target_include_directories(palpate_abi INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/palpate>)
target_link_libraries(palpate_abi INTERFACE Eigen3::Eigen)
if(PALPATE_SANITIZE)
  target_compile_options(palpate_abi INTERFACE -fsanitize=${PALPATE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(palpate_abi INTERFACE -fsanitize=${PALPATE_SANITIZE})
  # GCC's thread sanitizer warns that it does not model fences. Those of Asio's and Beast's handlers are beside queues that have locks;
  # the project has none.
  if(PALPATE_SANITIZE MATCHES "thread")
    target_compile_options(palpate_abi INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>)
  endif()
endif()
if(PALPATE_FUZZ)
  target_compile_options(palpate_abi INTERFACE -fsanitize=fuzzer-no-link)
endif()

# What turns a mistake with memory into the end of the program, or into nothing, in place of code of whoever made the datagram or file:
# canaries on the stack, sizes that the C library checks (_FORTIFY_SOURCE), programs at addresses drawn anew with tables that are
# read-only once they are filled (PIE, RELRO, BIND_NOW). Sanitizers bring checks of their own.
add_library(palpate_hardening INTERFACE)
if(NOT PALPATE_SANITIZE)
  target_link_options(palpate_hardening INTERFACE -pie -Wl,-z,relro,-z,now)
  set(level 2)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12)
    set(level 3)  # sizes known only when the program runs, too
  endif()
  target_compile_options(palpate_hardening INTERFACE -fstack-protector-strong
    $<$<NOT:$<BOOL:$<TARGET_PROPERTY:POSITION_INDEPENDENT_CODE>>>:-fPIE>
    $<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=${level}>)
endif()

set_property(GLOBAL PROPERTY PALPATE_LIBRARIES "")
set_property(GLOBAL PROPERTY PALPATE_LINKERS "")

# Remembers what TARGET of LAYER wants to link, for palpate_check_links().
function(palpate_record_links TARGET LAYER)
  set_property(GLOBAL APPEND PROPERTY PALPATE_LINKERS ${TARGET})
  set_property(GLOBAL PROPERTY PALPATE_LAYER_${TARGET} ${LAYER})
  set_property(GLOBAL PROPERTY PALPATE_LINKS_${TARGET} "${ARGN}")
endfunction()

# Loops over numbers become vector code; none of these changes a value. Not for the sanitizers, whose checks inside them take the
# compiler twice as long.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_BUILD_TYPE STREQUAL "Debug" AND NOT PALPATE_SANITIZE)
  set(PALPATE_LOOP_FLAGS -O3 -fno-math-errno -fno-trapping-math)
endif()

# Several files of a folder compiled as one unit read Eigen once and instantiate what they share once: a build from nothing takes half
# the processor time (docs/decisions/0004-cmake-libraries.md). Names in unnamed namespaces are therefore unique within a folder.
function(palpate_unity TARGET)
  set_target_properties(${TARGET} PROPERTIES UNITY_BUILD ${PALPATE_UNITY} UNITY_BUILD_BATCH_SIZE 6)
endfunction()

# Headers that most units include are read once for each set of flags (docs/decisions/0004-cmake-libraries.md). Files name what they include
# all the same, as presets without unity builds do without this.
if(PALPATE_UNITY AND NOT PALPATE_SANITIZE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(PALPATE_PRECOMPILE ON)
  set(PALPATE_COMMON_HEADERS <Eigen/Dense> <algorithm> <array> <chrono> <cmath> <deque> <filesystem> <fstream> <functional> <map> <memory>
    <optional> <random> <set> <span> <sstream> <string> <thread> <variant> <vector>)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/no_code.cpp CONTENT "")
endif()

# palpate_flag_set(TARGET library|hot|loops|program): compiles TARGET with the flags of its set, and with their precompiled headers
function(palpate_flag_set TARGET SET)
  palpate_set_flags(${TARGET} ${SET})
  if(NOT PALPATE_PRECOMPILE)
    return()
  endif()
  if(NOT TARGET palpate_headers_${SET})
    add_library(palpate_headers_${SET} OBJECT ${PROJECT_BINARY_DIR}/no_code.cpp)
    palpate_set_flags(palpate_headers_${SET} ${SET})
    target_precompile_headers(palpate_headers_${SET} PRIVATE ${PALPATE_COMMON_HEADERS})
  endif()
  target_precompile_headers(${TARGET} REUSE_FROM palpate_headers_${SET})
  target_compile_options(${TARGET} PRIVATE -fpch-preprocess)  # for ccache
endfunction()

function(palpate_set_flags TARGET SET)
  target_link_libraries(${TARGET} PRIVATE $<BUILD_INTERFACE:palpate_flags> $<BUILD_INTERFACE:palpate_abi>)
  if(SET STREQUAL "program")
    target_link_libraries(${TARGET} PRIVATE palpate_hardening)
  else()
    # Shared objects (bindings/) hold these libraries as well as programs do. What is hidden cannot be replaced from outside, so that the
    # compiler inlines and addresses it as it does in a program (docs/decisions/0069-bindings.md).
    set_target_properties(${TARGET} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
    target_compile_options(${TARGET} PRIVATE $<TARGET_PROPERTY:palpate_hardening,INTERFACE_COMPILE_OPTIONS>)
  endif()
  if(SET MATCHES "program|library")  # indices of the standard library, checked: one of a kernel costs as much as what it computes
    target_compile_definitions(${TARGET} PRIVATE _GLIBCXX_ASSERTIONS)
    if(PALPATE_PRECOMPILE)
      # In precompiled headers GCC 12 warns of what it takes the standard library's strings for (GCC bug 105651).
      target_compile_options(${TARGET} PRIVATE -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
    endif()
  endif()
  if(SET STREQUAL "loops")
    target_compile_options(${TARGET} PRIVATE ${PALPATE_LOOP_FLAGS})
  endif()
endfunction()

function(palpate_library NAME)
  cmake_parse_arguments(LIBRARY "LOCAL;LOOPS;HOT" "LAYER" "DEPENDS;PRIVATE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  set(target palpate_${NAME})
  if(sources)
    add_library(${target} STATIC ${sources})
    palpate_unity(${target})
    target_link_libraries(${target} PUBLIC palpate_abi ${LIBRARY_DEPENDS} PRIVATE ${LIBRARY_PRIVATE})
    if(LIBRARY_LOOPS)
      palpate_flag_set(${target} loops)
    elseif(LIBRARY_HOT)
      palpate_flag_set(${target} hot)
    else()
      palpate_flag_set(${target} library)
    endif()
  else()
    add_library(${target} INTERFACE)
    target_link_libraries(${target} INTERFACE palpate_abi ${LIBRARY_DEPENDS})
  endif()
  add_library(Palpate::${NAME} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${NAME})
  if(NOT LIBRARY_LOCAL)
    set_property(GLOBAL APPEND PROPERTY PALPATE_LIBRARIES ${target})
  endif()
  palpate_record_links(${target} ${LIBRARY_LAYER} ${LIBRARY_DEPENDS} ${LIBRARY_PRIVATE})
endfunction()

# palpate_program(NAME [PACKAGE package] DEPENDS targets...): a command-line program from the .cpp files of this folder. Its layer is its
# side's; the Debian package that holds it has its name unless given.
function(palpate_program NAME)
  cmake_parse_arguments(PROGRAM "" "PACKAGE" "DEPENDS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(NOT sources)
    message(STATUS "${NAME} has no sources in ${CMAKE_CURRENT_SOURCE_DIR}: left out")
    return()
  endif()
  add_executable(${NAME} ${sources})
  palpate_unity(${NAME})
  palpate_flag_set(${NAME} program)
  target_link_libraries(${NAME} PRIVATE ${PROGRAM_DEPENDS})
  target_compile_definitions(${NAME} PRIVATE PALPATE_VERSION="${PROJECT_VERSION}")
  if(NOT PROGRAM_PACKAGE)
    set(PROGRAM_PACKAGE ${NAME})
  endif()
  set_target_properties(${NAME} PROPERTIES PALPATE_PACKAGE ${PROGRAM_PACKAGE})
  install(TARGETS ${NAME} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${PROGRAM_PACKAGE})
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  if(folder MATCHES "^common/")
    set(layer 1)
  elseif(folder MATCHES "^server/")
    set(layer 2)
  elseif(folder MATCHES "^client/")
    set(layer 3)
  else()
    set(layer 4)
  endif()
  palpate_record_links(${NAME} ${layer} ${PROGRAM_DEPENDS})
endfunction()

# Call once, after the last library.
function(palpate_check_links)
  get_property(linkers GLOBAL PROPERTY PALPATE_LINKERS)
  foreach(target IN LISTS linkers)
    get_property(layer GLOBAL PROPERTY PALPATE_LAYER_${target})
    get_property(links GLOBAL PROPERTY PALPATE_LINKS_${target})
    foreach(link IN LISTS links)
      string(REPLACE "Palpate::" "palpate_" dep "${link}")
      get_property(dep_layer GLOBAL PROPERTY PALPATE_LAYER_${dep})
      if(NOT dep_layer STREQUAL "" AND (dep_layer GREATER layer OR (layer EQUAL 3 AND dep_layer EQUAL 2)))
        message(FATAL_ERROR "${target} (layer ${layer}) may not link ${dep} (layer ${dep_layer})")
      endif()
    endforeach()
  endforeach()
endfunction()

# How Eigen aligns depends on -march: a program with another one than the libraries has other layouts of the same types, and would end in
# the middle of nowhere. HEADER, to be installed in the place of common/base/types.hpp, which all others include, refuses it.
function(palpate_header_with_alignment HEADER)
  set(source ${PROJECT_BINARY_DIR}/alignment.cpp)
  file(WRITE ${source} "#include <Eigen/Core>\nalignment EIGEN_MAX_ALIGN_BYTES\n")
  get_target_property(eigen Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
  separate_arguments(flags UNIX_COMMAND "${CMAKE_CXX_FLAGS}")
  list(TRANSFORM eigen PREPEND -I)
  execute_process(COMMAND ${CMAKE_CXX_COMPILER} -std=c++20 ${flags} ${PALPATE_NATIVE_FLAGS} ${eigen} -E ${source}
    OUTPUT_VARIABLE expanded COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCH "\nalignment ([0-9]+)" found "${expanded}")
  if(NOT found)
    message(FATAL_ERROR "Eigen does not say how it aligns")
  endif()
  set(alignment ${CMAKE_MATCH_1})
  string(JOIN " " built_with ${flags} ${PALPATE_NATIVE_FLAGS})
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/common/base/types.hpp)
  file(READ ${PROJECT_SOURCE_DIR}/common/base/types.hpp text)
  file(WRITE ${HEADER} "${text}
static_assert(EIGEN_MAX_ALIGN_BYTES == ${alignment},
              \"Palpate's libraries were built for another processor than this file is compiled for: types of Eigen would lie in memory \"
              \"in another way. Compile it with the -march of the libraries (flags: '${built_with}'), as Palpate::abi has them.\");
")
endfunction()

function(palpate_export)
  get_property(libraries GLOBAL PROPERTY PALPATE_LIBRARIES)
  install(TARGETS ${libraries} palpate_abi palpate_asio EXPORT PalpateTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libpalpate-dev)
  set_target_properties(palpate_abi PROPERTIES EXPORT_NAME abi)
  set_target_properties(palpate_asio PROPERTIES EXPORT_NAME asio)
  install(EXPORT PalpateTargets NAMESPACE Palpate:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Palpate
    COMPONENT libpalpate-dev)
  foreach(folder common server client bench)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/palpate COMPONENT libpalpate-dev
      FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h" PATTERN "app" EXCLUDE PATTERN "view" EXCLUDE PATTERN "web" EXCLUDE PATTERN "igtl" EXCLUDE PATTERN "lab" EXCLUDE PATTERN "command_line" EXCLUDE PATTERN "output" EXCLUDE PATTERN "report" EXCLUDE PATTERN "tissue" EXCLUDE PATTERN "micro" EXCLUDE PATTERN "metrics" EXCLUDE)
  endforeach()
  palpate_header_with_alignment(${PROJECT_BINARY_DIR}/installed/types.hpp)
  install(FILES ${PROJECT_BINARY_DIR}/installed/types.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/palpate/common/base COMPONENT libpalpate-dev)
  include(CMakePackageConfigHelpers)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/PalpateConfig.cmake.in
    ${PROJECT_BINARY_DIR}/PalpateConfig.cmake INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Palpate)
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/PalpateConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/PalpateConfig.cmake ${PROJECT_BINARY_DIR}/PalpateConfigVersion.cmake
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Palpate COMPONENT libpalpate-dev)
endfunction()
