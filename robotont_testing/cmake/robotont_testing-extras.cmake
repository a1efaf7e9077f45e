# For the CMakeLists.txt of each package: registers test/*.test with rostest, and test/test_*.py as one run of pytest; what
# takes minutes runs only when it is asked for (./robotont test -m long, --nightly).
function(robotont_add_tests)
  file(GLOB rostests CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/test/*.test)
  list(FILTER rostests EXCLUDE REGEX "/(long|nightly)_[^/]*$")
  if(rostests)
    find_package(rostest REQUIRED)
  endif()
  foreach(rostest ${rostests})
    add_rostest(${rostest})
  endforeach()
  file(GLOB unit_tests CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/test/test_*.py)
  if(unit_tests)
    set(marks "not rostest and not faults and not long and not nightly")
    set(report ${CATKIN_TEST_RESULTS_DIR}/${PROJECT_NAME}/pytest.xml)
    catkin_run_tests_target("pytest" ${PROJECT_NAME} pytest.xml
      COMMAND "${PYTHON_EXECUTABLE} -m pytest -m '${marks}' --junitxml=${report} ${CMAKE_CURRENT_SOURCE_DIR}/test"
      WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
  endif()
endfunction()
