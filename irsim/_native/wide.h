/* A loop marked WIDE is compiled twice, for processors with wider registers too; which runs is found out when it is
 * loaded. That takes the GNU linker and loader. */
#ifndef IRSIM_WIDE_H
#define IRSIM_WIDE_H

#if defined(__x86_64__) && defined(__GNUC__) && defined(__gnu_linux__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

#endif
