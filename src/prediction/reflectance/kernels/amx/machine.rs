//! AMX instructions. All memory that they read and write is checked by [`super::tiles`], their only
//! caller.

#![allow(unsafe_code)]

use super::Precision;
use super::layout::{Blocking, Blocks, Factor, ROW_BYTES, SIDE};
use std::arch::asm;
use std::arch::x86_64::{__cpuid, __cpuid_count};
use std::sync::LazyLock;

pub fn available() -> bool {
    static AVAILABLE: LazyLock<bool> = LazyLock::new(|| {
        const BF16: u32 = 1 << 22;
        const TILE: u32 = 1 << 24;
        /// `ARCH_REQ_XCOMP_PERM` of the tiles' data, from Linux' asm/prctl.h.
        const REQUEST: libc::c_long = 0x1023;
        const TILE_DATA: libc::c_long = 18;
        if __cpuid(0).eax < 7 || __cpuid_count(7, 0).edx & (BF16 | TILE) != BF16 | TILE {
            return false;
        }
        if !is_x86_feature_detected!("avx512f") {
            return false;
        }
        // SAFETY: the call takes two numbers, and grants registers that only this file touches.
        unsafe { libc::syscall(libc::SYS_arch_prctl, REQUEST, TILE_DATA) == 0 }
    });
    *AVAILABLE
}

/// Input of `ldtilecfg`.
#[repr(C, align(64))]
struct Configuration {
    palette: u8,
    start_row: u8,
    reserved: [u8; 14],
    row_bytes: [u16; 16],
    rows: [u8; 16],
}

/// Sums in registers 0 to 3, left factors in 4 and 5, right factors in 6 and 7.
///
/// # Safety
///
/// [`available`] was true, and there are 1 to 16 pairs.
pub unsafe fn configure(pairs: usize) {
    let (mut row_bytes, mut rows) = ([0; 16], [0; 16]);
    row_bytes[..8].fill(ROW_BYTES as u16);
    rows[..8].fill(SIDE as u8);
    row_bytes[4..6].fill(4 * pairs as u16);
    rows[6..8].fill(pairs as u8);
    let configuration =
        Configuration { palette: 1, start_row: 0, reserved: [0; 14], row_bytes, rows };
    // SAFETY: `with_tiles`, the only caller, has made sure that the processor has tiles and that
    // the system lets us use them, and that there are 1 to 16 pairs; the 64 bytes that are read
    // are those of `configuration`. No compiled code holds anything in these registers.
    unsafe {
        asm!(
            "ldtilecfg [{}]",
            in(reg) &raw const configuration,
            out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
            out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
            options(nostack, readonly, preserves_flags),
        );
    }
}

/// Frees the registers.
///
/// # Safety
///
/// [`available`] was true.
pub unsafe fn release() {
    // SAFETY: as in `configure`, whose counterpart in `with_tiles` this is.
    unsafe {
        asm!(
            "tilerelease",
            out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
            out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
            options(nostack, nomem, preserves_flags),
        );
    }
}

/// The loop over the steps around the instructions of one, in which `p` and `q` are the places of
/// the factors' tiles. The caller has checked that all of them lie within the factors and that
/// there is a step.
macro_rules! steps {
    ($left:ident, $right:ident, $steps:ident, $into:ident, $($line:literal)*) => {
        asm!(
            "tilezero tmm0",
            "tilezero tmm1",
            "tilezero tmm2",
            "tilezero tmm3",
            "2:",
            "mov {p}, [{step}]",
            "mov {q}, [{step} + 8]",
            "add {p}, {a}",
            "add {q}, {b}",
            $($line,)*
            "add {step}, 16",
            "cmp {step}, {end}",
            "jne 2b",
            "mov {p:e}, 64",
            "tilestored [{into} + {p}*1], tmm0",
            "tilestored [{into} + {p}*1 + 1024], tmm1",
            "tilestored [{into} + {p}*1 + 2048], tmm2",
            "tilestored [{into} + {p}*1 + 3072], tmm3",
            "/* {an} {al} {bn} {bl} */",
            p = out(reg) _,
            q = out(reg) _,
            step = inout(reg) $steps.as_ptr() => _,
            end = in(reg) $steps.as_ptr_range().end,
            a = in(reg) $left.bytes.as_ptr().wrapping_add($left.start),
            ar = in(reg) $left.row,
            an = in(reg) $left.next,
            al = in(reg) $left.low,
            b = in(reg) $right.bytes.as_ptr().wrapping_add($right.start),
            br = in(reg) $right.row,
            bn = in(reg) $right.next,
            bl = in(reg) $right.low,
            into = in(reg) $into.as_mut_ptr(),
            out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
            out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
            options(nostack),
        )
    };
}

/// The sums over all steps, of which there is at least one.
///
/// # Safety
///
/// The registers are configured on this thread, and every tile that the steps name lies within its
/// factor.
pub unsafe fn sum(
    blocking: Blocking,
    precision: Precision,
    left: &Factor,
    right: &Factor,
    steps: &[[usize; 2]],
    into: &mut Blocks,
) {
    // SAFETY: `Tiles::sum`, the only caller, has checked for the largest offsets in `steps` that
    // every tile of both factors lies within them, and that there is a step. Without low parts
    // none is read. `into` has room for the four stores of 1024 bytes. The registers were set up
    // on this thread, else there were no `Tiles` to call it with, and no compiled code holds
    // anything in them: sums live in them only within one block of assembly.
    unsafe {
        match (blocking, precision) {
            (Blocking::Square, Precision::Half) => steps!(left, right, steps, into,
                "tileloadd tmm4, [{p} + {ar}*1]"
                "tileloadd tmm6, [{q} + {br}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "add {q}, {bn}"
                "tileloadd tmm7, [{q} + {br}*1]"
                "tdpbf16ps tmm1, tmm4, tmm7"
                "add {p}, {an}"
                "tileloadd tmm5, [{p} + {ar}*1]"
                "tdpbf16ps tmm2, tmm5, tmm6"
                "tdpbf16ps tmm3, tmm5, tmm7"
            ),
            (Blocking::Square, Precision::Split) => steps!(left, right, steps, into,
                "add {q}, {bl}"
                "tileloadd tmm4, [{p} + {ar}*1]"
                "tileloadd tmm6, [{q} + {br}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "add {q}, {bn}"
                "tileloadd tmm7, [{q} + {br}*1]"
                "tdpbf16ps tmm1, tmm4, tmm7"
                "add {p}, {an}"
                "tileloadd tmm5, [{p} + {ar}*1]"
                "tdpbf16ps tmm2, tmm5, tmm6"
                "tdpbf16ps tmm3, tmm5, tmm7"
                "sub {q}, {bl}"
                "sub {q}, {bn}"
                "tileloadd tmm6, [{q} + {br}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "add {q}, {bn}"
                "tileloadd tmm7, [{q} + {br}*1]"
                "tdpbf16ps tmm1, tmm4, tmm7"
                "tdpbf16ps tmm2, tmm5, tmm6"
                "tdpbf16ps tmm3, tmm5, tmm7"
                "add {p}, {al}"
                "tileloadd tmm5, [{p} + {ar}*1]"
                "sub {p}, {an}"
                "tileloadd tmm4, [{p} + {ar}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "tdpbf16ps tmm1, tmm4, tmm7"
                "tdpbf16ps tmm2, tmm5, tmm6"
                "tdpbf16ps tmm3, tmm5, tmm7"
            ),
            (Blocking::Wide, Precision::Half) => steps!(left, right, steps, into,
                "tileloadd tmm4, [{p} + {ar}*1]"
                "tileloadd tmm6, [{q} + {br}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "add {q}, {bn}"
                "tileloadd tmm7, [{q} + {br}*1]"
                "tdpbf16ps tmm1, tmm4, tmm7"
                "add {q}, {bn}"
                "tileloadd tmm6, [{q} + {br}*1]"
                "tdpbf16ps tmm2, tmm4, tmm6"
                "add {q}, {bn}"
                "tileloadd tmm7, [{q} + {br}*1]"
                "tdpbf16ps tmm3, tmm4, tmm7"
            ),
            (Blocking::Wide, Precision::Split) => steps!(left, right, steps, into,
                "tileloadd tmm4, [{p} + {ar}*1]"
                "add {p}, {al}"
                "tileloadd tmm5, [{p} + {ar}*1]"
                "lea {p}, [{q} + {bl}]"
                "tileloadd tmm6, [{p} + {br}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "add {p}, {bn}"
                "tileloadd tmm7, [{p} + {br}*1]"
                "tdpbf16ps tmm1, tmm4, tmm7"
                "add {p}, {bn}"
                "tileloadd tmm6, [{p} + {br}*1]"
                "tdpbf16ps tmm2, tmm4, tmm6"
                "add {p}, {bn}"
                "tileloadd tmm7, [{p} + {br}*1]"
                "tdpbf16ps tmm3, tmm4, tmm7"
                "tileloadd tmm6, [{q} + {br}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "add {q}, {bn}"
                "tileloadd tmm7, [{q} + {br}*1]"
                "tdpbf16ps tmm1, tmm4, tmm7"
                "tdpbf16ps tmm0, tmm5, tmm6"
                "tdpbf16ps tmm1, tmm5, tmm7"
                "add {q}, {bn}"
                "tileloadd tmm6, [{q} + {br}*1]"
                "tdpbf16ps tmm2, tmm4, tmm6"
                "add {q}, {bn}"
                "tileloadd tmm7, [{q} + {br}*1]"
                "tdpbf16ps tmm3, tmm4, tmm7"
                "tdpbf16ps tmm2, tmm5, tmm6"
                "tdpbf16ps tmm3, tmm5, tmm7"
            ),
            (Blocking::Tall, Precision::Half) => steps!(left, right, steps, into,
                "tileloadd tmm6, [{q} + {br}*1]"
                "tileloadd tmm4, [{p} + {ar}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "add {p}, {an}"
                "tileloadd tmm5, [{p} + {ar}*1]"
                "tdpbf16ps tmm1, tmm5, tmm6"
                "add {p}, {an}"
                "tileloadd tmm4, [{p} + {ar}*1]"
                "tdpbf16ps tmm2, tmm4, tmm6"
                "add {p}, {an}"
                "tileloadd tmm5, [{p} + {ar}*1]"
                "tdpbf16ps tmm3, tmm5, tmm6"
            ),
            (Blocking::Tall, Precision::Split) => steps!(left, right, steps, into,
                "tileloadd tmm6, [{q} + {br}*1]"
                "add {q}, {bl}"
                "tileloadd tmm7, [{q} + {br}*1]"
                "lea {q}, [{p} + {al}]"
                "tileloadd tmm4, [{p} + {ar}*1]"
                "tdpbf16ps tmm0, tmm4, tmm7"
                "add {p}, {an}"
                "tileloadd tmm5, [{p} + {ar}*1]"
                "tdpbf16ps tmm1, tmm5, tmm7"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "tdpbf16ps tmm1, tmm5, tmm6"
                "add {p}, {an}"
                "tileloadd tmm4, [{p} + {ar}*1]"
                "tdpbf16ps tmm2, tmm4, tmm7"
                "add {p}, {an}"
                "tileloadd tmm5, [{p} + {ar}*1]"
                "tdpbf16ps tmm3, tmm5, tmm7"
                "tdpbf16ps tmm2, tmm4, tmm6"
                "tdpbf16ps tmm3, tmm5, tmm6"
                "tileloadd tmm4, [{q} + {ar}*1]"
                "tdpbf16ps tmm0, tmm4, tmm6"
                "add {q}, {an}"
                "tileloadd tmm5, [{q} + {ar}*1]"
                "tdpbf16ps tmm1, tmm5, tmm6"
                "add {q}, {an}"
                "tileloadd tmm4, [{q} + {ar}*1]"
                "tdpbf16ps tmm2, tmm4, tmm6"
                "add {q}, {an}"
                "tileloadd tmm5, [{q} + {ar}*1]"
                "tdpbf16ps tmm3, tmm5, tmm6"
            ),
        }
    }
}
