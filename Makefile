# SPDX-License-Identifier: Apache-2.0
# make run     builds the program and the page and serves DATA, or generated demo data, on loopback
# make test    builds and runs the tests
# make check   does more: sanitizers, clang-tidy, fuzzing, hostile clients with large volumes, and make test with
#              all combinations in the statistical tests and 2000 random scenes. May be interrupted and continued
# make fuzz    runs every fuzzer for another FUZZ_SECONDS, on the corpus of earlier runs
# make soak    tests SCENES more random scenes, starting where the last run ended; keeps failing ones in build/soak
DATA ?=
PORT ?= 8080
# ON: with CUDA, if nvcc is installed; its kernels take a quarter of an hour to compile
CUDA ?= OFF
JOBS ?= $(shell nproc)
FUZZ_SECONDS ?= 600
SCENES ?= 20000
# run-tests,BUILD,OPTIONS: runs tests and lists those that were skipped. A label without tests is a mistake in this file:
# fail.
define run-tests
ctest --no-tests=error --test-dir build/$(1) --output-on-failure $(2)
@sed -n 's/ ([0-9]* ms)$$//; /^\[  SKIPPED \] .*\./p' build/$(1)/Testing/Temporary/LastTest.log | sort -u
endef
DEMO := build/demo/orbitals.nrrd
SCOLOPAX := build/release/scolopax

# Parallel recipes would run .ci/install twice at once; the tools called use all processors by themselves.
.NOTPARALLEL:
.DELETE_ON_ERROR:
.PHONY: fuzzers run build web test check check-test check-bench check-hostile check-asan-ubsan check-tsan check-tidy check-fuzz check-format check-cuda fuzz soak deps test-deps check-deps format clean

run: build web $(if $(strip $(DATA)),,$(DEMO))
	exec $(SCOLOPAX) serve $(if $(strip $(DATA)),$(DATA),$(DEMO)) --port $(PORT)

$(DEMO): | build
	mkdir -p $(dir $@)
	$(SCOLOPAX) generate orbitals $@

# Configured without the tests, whose libraries may not be installed, until `make test` has configured with them.
build: deps
	cmake --preset release -DSCOLOPAX_CUDA=$(CUDA) -DBUILD_TESTING=$(if $(wildcard build/release/tests),ON,OFF) > /dev/null
	cmake --build --preset release --target scolopax -j $(JOBS)

web: deps
	cd client_web && npm run --silent build

test: test-deps web
	cmake --preset release -DBUILD_TESTING=ON > /dev/null
	cmake --build --preset release -j $(JOBS)
	$(call run-tests,release,-j $(JOBS) -LE hostile)

# A target's variables also apply to its prerequisites, unless these have their own: the first two are for test.
check: export SCOLOPAX_COMBINATIONS := all
check: export SCOLOPAX_RANDOM_SCENES := 2000
check-asan-ubsan: export SCOLOPAX_COMBINATIONS := pairs
check-asan-ubsan: export SCOLOPAX_STATISTICS := 0.1
check-asan-ubsan: export SCOLOPAX_RANDOM_SCENES := 20
check-asan-ubsan: export ASAN_SYMBOLIZER_PATH := /usr/lib/llvm-19/bin/llvm-symbolizer
check: $(foreach stage,format test bench hostile asan-ubsan cuda fuzz tsan tidy,passed-$(stage))

# A stage that has passed is not run again on the same commit, so that an interrupted check can be continued.
passed-%:
	@commit=$$(git status --porcelain | grep -q . && echo changed || git rev-parse HEAD); \
	if [ $$commit = changed ] || [ "$$(cat build/passed/$* 2> /dev/null)" != $$commit ]; then \
	  $(MAKE) check-$* && mkdir -p build/passed && echo $$commit > build/passed/$*; \
	else echo "check-$* has passed on this commit"; fi

check-test: test

# Benchmarks are otherwise built only for a report. This checks that they still compile.
check-bench: test-deps
	cmake --preset release -DBUILD_TESTING=ON > /dev/null
	cmake --build --preset release -j $(JOBS) --target bench_rebuild bench_layout bench_resolutions bench_peaks \
	  ptx_costs

check-hostile: test-deps
	cmake --preset release -DBUILD_TESTING=ON > /dev/null
	cmake --build --preset release -j $(JOBS)
	$(call run-tests,release,-L hostile)

check-asan-ubsan: check-deps
	cmake --preset asan-ubsan > /dev/null
	cmake --build --preset asan-ubsan -j $(JOBS)
	$(call run-tests,asan-ubsan,-j $(JOBS) -LE 'web|statistics|hostile')
	$(call run-tests,asan-ubsan,-j $(JOBS) -L hard)

# Checks the server's threads, with fake renderers: the real ones use TBB, which is not instrumented. All four parts
# at once, because they mostly wait.
check-tsan: test-deps
	cmake --preset tsan > /dev/null
	cmake --build --preset tsan -j $(JOBS)
	TSAN_OPTIONS=suppressions=$(CURDIR)/tests/support/tsan.supp \
	  $(call run-tests,tsan,-j 4 -L unit-server)

check-fuzz: fuzzers
	$(call run-tests,fuzz,-j $(JOBS) -L fuzz)

fuzzers: check-deps
	cmake --preset fuzz > /dev/null
	cmake --build --preset fuzz -j $(JOBS)

fuzz: fuzzers
	for corpus in build/fuzz/corpus/*; do \
	  build/fuzz/$$(basename $$corpus) -max_total_time=$(FUZZ_SECONDS) -rss_limit_mb=2048 -timeout=10 \
	    -artifact_prefix=build/fuzz/ $$corpus $$(ls -d tests/fuzz/seeds/$$(basename $$corpus _fuzz) 2> /dev/null) || exit 1; \
	done

# Runs in batches, so that stopping loses little. The first 2000 scenes are those of make check.
soak: test-deps
	cmake --preset release -DBUILD_TESTING=ON > /dev/null
	cmake --build --preset release --target tests_random_scenes -j $(JOBS)
	mkdir -p build/soak
	first=$$(cat build/soak/next 2> /dev/null || echo 2000); end=$$((first + $(SCENES))); failed=0; \
	while [ $$first -lt $$end ]; do \
	  SCOLOPAX_RANDOM_SCENES=500 SCOLOPAX_RANDOM_SCENES_FIRST=$$first SCOLOPAX_RANDOM_SCENES_FOLDER=build/soak \
	    build/release/tests_random_scenes --gtest_brief=1 --gtest_filter='*RandomScenes*' || failed=1; \
	  first=$$((first + 500)); echo $$first > build/soak/next; echo "scenes below $$first are done"; \
	done; exit $$failed

# Needs nvcc. Without it, configuring prints a notice and nothing is checked.
check-cuda: test-deps
	cmake --preset cuda > /dev/null
	cmake --build --preset cuda -j $(JOBS) --target cuda_checks
	$(call run-tests,cuda,-L cuda)

# clang 14 supports coroutines but does not define their feature macro, which Boost and libstdc++ test. It does not know
# all of gcc's warnings.
TIDY := clang-tidy --quiet --extra-arg=-Wno-unknown-warning-option \
  --extra-arg=-D__cpp_impl_coroutine=201902L --extra-arg=-DBOOST_ASIO_HAS_CO_AWAIT=1 --extra-arg=-DBOOST_ASIO_HAS_STD_COROUTINE=1

# Checks the sources that the build compiles, in the same units.
check-tidy: build check-deps
	sed -n 's/^ *"file": "\(.*\)".*/\1/p' build/release/compile_commands.json | grep -v /tests/ | sort -u \
	  | xargs -P $(JOBS) -n 1 $(TIDY) -p build/release

check-format: check-deps
	git ls-files '*.cpp' '*.h' '*.cu' | xargs clang-format --dry-run --Werror

format:
	git ls-files '*.cpp' '*.h' '*.cu' | xargs clang-format -i

deps:
	@.ci/install build

test-deps:
	@.ci/install build test

check-deps:
	@.ci/install build test check

clean:
	rm -rf build client_web/dist client_web/node_modules
