//! Choice of the registers that a kernel is compiled for.

/// Calls `kernel(state, lanes, …)`, compiled for AVX2 where the processor has it. Both give the same bits.
macro_rules! wide {
    ($kernel:ident($state:expr, $($arg:ident: $kind:ty),*)) => {{
        use $crate::live::solver::explicit::simd;
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2,fma")]
            fn avx2(state: &mut PatchState, l: simd::Avx2, $($arg: $kind),*) {
                $kernel(state, l, $($arg),*);
            }
            match simd::Avx2::detect() {
                // Sound: the processor was queried.
                #[allow(unsafe_code)]
                Some(l) => unsafe { avx2($state, l, $($arg),*) },
                None => $kernel($state, simd::Scalar, $($arg),*),
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        $kernel($state, simd::Scalar, $($arg),*);
    }};
}
pub(super) use wide;
