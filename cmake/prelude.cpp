// Makes a precompiled header: see alidade_prelude and alidade_test_prelude in AlidadeTargets.cmake.
