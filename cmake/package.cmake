# Debian packages: server, client, view, web, lab, their scenes, documents and headers. `./dev package` builds them with the preset `package`
# and CPack; what belongs to which is in docs/packages.md.
if(PALPATE_NATIVE OR PALPATE_SANITIZE OR NOT (PALPATE_BENCH AND PALPATE_VIEW AND PALPATE_WEB AND PALPATE_BINDINGS))
  message(FATAL_ERROR "packages are built for any processor, without sanitizers, with palpate-lab, palpate-view, palpate-web and bindings")
endif()
foreach(tool help2man gzip)
  find_program(PALPATE_${tool} ${tool} REQUIRED)
endforeach()

set(files ${PROJECT_SOURCE_DIR}/cmake/package)
set(doc ${CMAKE_INSTALL_DATAROOTDIR}/doc)
set(share ${CMAKE_INSTALL_DATAROOTDIR}/palpate)
set(programs palpate-server palpate-client palpate-relay palpate-view palpate-web palpate-bridge palpate-lab palpate-fidelity palpate-key)
set(CPACK_COMPONENTS_ALL palpate-server palpate-client palpate-key palpate-view palpate-web palpate-lab palpate-data palpate-doc python3-palpate libpalpate1
  libpalpate-dev)

# Manual pages, of subcommands too, from what the programs themselves say.
set(stamps)
foreach(program IN LISTS programs)
  set(stamp ${PROJECT_BINARY_DIR}/man/${program}.stamp)
  add_custom_command(OUTPUT ${stamp}
    COMMAND ${files}/make-man $<TARGET_FILE:${program}> ${files}/man ${PROJECT_BINARY_DIR}/man/${program}
    COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
    DEPENDS ${program} ${files}/make-man ${files}/man/${program}.h2m ${files}/man/every.h2m
    COMMENT "Manual pages of ${program}" VERBATIM)
  get_target_property(package ${program} PALPATE_PACKAGE)
  install(DIRECTORY ${PROJECT_BINARY_DIR}/man/${program}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${package})
  list(APPEND stamps ${stamp})
endforeach()
get_property(libraries GLOBAL PROPERTY PALPATE_LIBRARIES)
add_custom_target(palpate_package DEPENDS ${stamps})
add_dependencies(palpate_package ${libraries} palpate_python palpate_c)

install(FILES ${files}/server/palpate-server.service DESTINATION /lib/systemd/system COMPONENT palpate-server)
install(FILES ${files}/server/palpate-server.default DESTINATION /etc/default RENAME palpate-server COMPONENT palpate-server)
install(FILES ${files}/client/60-palpate.rules DESTINATION /lib/udev/rules.d COMPONENT palpate-client)
install(FILES ${files}/client/lintian-overrides DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/lintian/overrides RENAME palpate-client COMPONENT palpate-client)
install(FILES ${files}/library/lintian-overrides DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/lintian/overrides RENAME libpalpate1 COMPONENT libpalpate1)
install(FILES ${files}/client/limits.conf DESTINATION ${doc}/palpate-client/examples COMPONENT palpate-client)
install(DIRECTORY docker/monitoring DESTINATION ${share} COMPONENT palpate-server)
install(DIRECTORY scenes DESTINATION ${share} COMPONENT palpate-data PATTERN "*.py" EXCLUDE)
install(DIRECTORY examples/python/ DESTINATION ${doc}/python3-palpate/examples COMPONENT python3-palpate)
install(DIRECTORY examples/c/ examples/csharp/ DESTINATION ${doc}/libpalpate-dev/examples COMPONENT libpalpate-dev)
install(DIRECTORY docs/ DESTINATION ${doc}/palpate COMPONENT palpate-doc)
install(FILES README.md DESTINATION ${doc}/palpate COMPONENT palpate-doc)
foreach(package IN LISTS CPACK_COMPONENTS_ALL)
  install(FILES ${files}/copyright DESTINATION ${doc}/${package} COMPONENT ${package})
  install(FILES ${PROJECT_BINARY_DIR}/changelog.gz ${PROJECT_BINARY_DIR}/changelog.Debian.gz DESTINATION ${doc}/${package} COMPONENT ${package})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME palpate)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PROJECT_CONFIG_FILE ${files}/cpack.cmake)
set(CPACK_PALPATE_SOURCE_DIR ${PROJECT_SOURCE_DIR})
set(CPACK_PALPATE_BINARY_DIR ${PROJECT_BINARY_DIR})
set(CPACK_PALPATE_GZIP ${PALPATE_gzip})
set(CPACK_PALPATE_PYTHON ${PALPATE_PYTHON_VERSION})  # a module is for one version of Python
set(CPACK_PALPATE_PYTHON_NEXT ${PALPATE_PYTHON_NEXT})
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
include(CPack)
