#pragma once

/// Marks a loop over many rays. On x86-64 it is compiled a second time for AVX2, and the processor
/// decides which one runs. Both do the same operations in the same order and none is fused, so that
/// no bit depends on it. Sanitizers start too late for functions that are chosen while loading.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
#define SOVO_SIM_KERNEL __attribute__((target_clones("avx2", "default")))
#else
#define SOVO_SIM_KERNEL
#endif
