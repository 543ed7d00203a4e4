// Makes the precompiled header of the test programs: see alidade_test_prelude in cmake/AlidadeTargets.cmake.
