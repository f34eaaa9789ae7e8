//! Whatever arrives as a payload is read or refused.

use flockform::messages::geometry_msgs::PoseArray;
use proptest::prelude::*;

use crate::structs::{Filled, every_struct};
use crate::wire::{decode, encode};

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..700)) {
        for Filled { decodes, .. } in every_struct() {
            decodes(&bytes);
        }
    }

    #[test]
    fn a_damaged_message_is_read_or_refused(
        damage in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
    ) {
        for Filled { mut bytes, decodes, .. } in every_struct() {
            for (place, value) in &damage {
                let place = place.index(bytes.len());
                bytes[place] = *value;
            }
            decodes(&bytes);
            decodes(&bytes[..cut.index(bytes.len())]);
        }
    }
}

#[test]
fn a_message_cut_short_is_refused() {
    for Filled { name, bytes, decodes, .. } in every_struct() {
        assert!(decodes(&bytes), "{name}");
        assert!(!decodes(&bytes[..bytes.len() - 1]), "{name} without its last byte");
    }
}

#[test]
fn a_count_that_the_payload_cannot_hold_is_refused_without_making_room_for_it() {
    let mut bytes = encode(&PoseArray::default());
    let count = bytes.len() - 4..;
    // 4 294 967 295 poses would be 240 GB.
    bytes[count].copy_from_slice(&u32::MAX.to_le_bytes());
    bytes.extend([0; 3 * 56]);
    assert!(decode::<PoseArray>(&bytes).is_err());
}
