# Read by cpack before it makes packages: what depends on the commit (version, maintainer, changelogs) and the packages' fields.
cmake_policy(VERSION 3.25)

# Version: that of a release when the commit has its tag. Any other commit comes before the release, and after the commits before it.
set(version ${CPACK_PACKAGE_VERSION})
set(maintainer "Palpate developers <palpate@localhost>")
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
function(ask_git NAME)
  execute_process(COMMAND git -C ${CPACK_PALPATE_SOURCE_DIR} ${ARGN} OUTPUT_VARIABLE answer OUTPUT_STRIP_TRAILING_WHITESPACE
    RESULT_VARIABLE result ERROR_QUIET)
  if(result EQUAL 0)
    set(${NAME} "${answer}" PARENT_SCOPE)
  endif()
endfunction()
ask_git(tags tag --points-at HEAD)
ask_git(commit log -1 --date=format-local:%Y%m%d.%H%M --format=~git%cd.%h)
ask_git(maintainer log -1 "--format=%an <%ae>")
ask_git(changes status --porcelain --untracked-files=no)
if(commit AND NOT "v${version}" IN_LIST tags)
  string(APPEND version ${commit})
endif()
if(changes)
  string(APPEND version "+local")
endif()
if(DEFINED ENV{DEBEMAIL})
  set(maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()
set(CPACK_PACKAGE_VERSION ${version})
set(CPACK_DEBIAN_PACKAGE_VERSION ${version})
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${maintainer}")

file(WRITE ${CPACK_PALPATE_BINARY_DIR}/changelog.Debian
  "palpate (${version}-1) unstable; urgency=medium\n\n  * Built from the sources; what is new is in changelog.gz.\n\n -- ${maintainer}  ${date}\n")
file(COPY_FILE ${CPACK_PALPATE_SOURCE_DIR}/CHANGELOG.md ${CPACK_PALPATE_BINARY_DIR}/changelog)
execute_process(COMMAND ${CPACK_PALPATE_GZIP} -9nf changelog changelog.Debian
  WORKING_DIRECTORY ${CPACK_PALPATE_BINARY_DIR} COMMAND_ERROR_IS_FATAL ANY)

set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # it would be every package's first line
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SOURCE palpate)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# describe(PACKAGE TEXT [FIELD value]...): the first line of TEXT is the synopsis; fields as CPACK_DEBIAN_<PACKAGE>_PACKAGE_<FIELD>.
macro(describe PACKAGE TEXT)
  string(TOUPPER ${PACKAGE} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${PACKAGE})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${TEXT}")
  set(fields ${ARGN})
  while(fields)
    list(POP_FRONT fields field value)
    set(CPACK_DEBIAN_${upper}_PACKAGE_${field} "${value}")
  endwhile()
endmacro()

set(same "(= ${version}-1)")
describe(palpate-server "touch of a deformable body over a network: server
Simulates soft bodies and sends each hand that touches them a small local
model of what it touches, over UDP.
.
A systemd service is included; it is not started by itself."
  DEPENDS "palpate-data ${same}" RECOMMENDS "palpate-key")
describe(palpate-client "touch of a deformable body over a network: station of a hand
Reads a haptic device a thousand times a second, plays the local models that
palpate-server sends, and writes the force; palpate-relay stands between the
two as a link that delays and loses what it passes on."
  RECOMMENDS "palpate-data, palpate-key" SUGGESTS "palpate-doc, palpate-view")
describe(palpate-key "touch of a deformable body over a network: keys
Makes the keys by which palpate-server and its stations know each other, and
signs tokens that let a station join once."
  SUGGESTS "palpate-doc")
describe(palpate-view "touch of a deformable body over a network: viewer
Shows the body that palpate-server simulates and the tools that touch it, in
a window or as pictures without a display; the mouse can be a hand."
  DEPENDS "libegl1, libgl1, fonts-dejavu-core" RECOMMENDS "libgl1-mesa-dri" SUGGESTS "palpate-doc")
describe(palpate-web "touch of a deformable body over a network: page for browsers
Shows the body that palpate-server simulates or a recording holds, and every
hand on it with its force, link and scheme, to browsers of this machine, or of
others that have a password; and to 3D Slicer over OpenIGTLink."
  SUGGESTS "palpate-doc")
describe(palpate-lab "touch of a deformable body over a network: experiments
Measures what a hand feels of delay, jitter and loss beside the full model at
1 kHz, in real runs, in recordings and in virtual time; repeats the published
experiments of multirate haptic simulation."
  DEPENDS "palpate-data ${same}" RECOMMENDS "gnuplot-nox | gnuplot" SUGGESTS "palpate-doc")
describe(palpate-data "touch of a deformable body over a network: scenes and motions
Bodies for palpate-server and palpate-lab, and recorded motions of hands for
the simulated devices of palpate-client."
  ARCHITECTURE all SHLIBDEPS OFF)
describe(palpate-doc "touch of a deformable body over a network: documentation
Scene files, the wire, recordings, devices, results and decisions."
  ARCHITECTURE all SHLIBDEPS OFF SECTION doc)
describe(python3-palpate "touch of a deformable body over a network: Python module
Bodies, patches, replays in virtual time and recordings as arrays; a hand or
a viewer at a server; environments for a learning program."
  SECTION python DEPENDS "python3 (>= ${CPACK_PALPATE_PYTHON}), python3 (<< ${CPACK_PALPATE_PYTHON_NEXT}), python3-numpy"
  RECOMMENDS "palpate-data" SUGGESTS "palpate-doc, python3-matplotlib")
describe(libpalpate1 "touch of a deformable body over a network: C library
Bodies and patches in a process of one's own, a hand and a viewer at a
server, for C and every language that calls it."
  SECTION libs RECOMMENDS "palpate-data")
describe(libpalpate-dev "touch of a deformable body over a network: development files
Headers of C and C++, static libraries and the CMake package for stations,
servers and experiments of one's own: find_package(Palpate)."
  SECTION libdevel SHLIBDEPS OFF
  DEPENDS "libpalpate1 ${same}, libasio-dev, libeigen3-dev (>= 3.4), libflatbuffers-dev, libfmt-dev, libhidapi-dev, libsodium-dev, libspdlog-dev, nlohmann-json3-dev, pkg-config, zlib1g-dev")

set(scripts ${CPACK_PALPATE_SOURCE_DIR}/cmake/package/server)
set(CPACK_DEBIAN_PALPATE-SERVER_PACKAGE_CONTROL_EXTRA ${scripts}/conffiles ${scripts}/postinst ${scripts}/prerm ${scripts}/postrm)
set(library ${CPACK_PALPATE_SOURCE_DIR}/cmake/package/library)
set(CPACK_DEBIAN_LIBPALPATE1_PACKAGE_CONTROL_EXTRA ${library}/shlibs ${library}/triggers)
