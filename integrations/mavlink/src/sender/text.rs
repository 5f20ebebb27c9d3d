//! `STATUSTEXT`.

use bb_estimators::navigation::state_estimator::{FlightEvent, Level};
use mavlink::dialects::ardupilotmega::{MavSeverity, STATUSTEXT_DATA};

/// Characters in one message.
const CHUNK: usize = 50;
/// The largest number of messages for one text, numbered by a byte.
const CHUNKS: usize = 256;

/// The severity of an event. It is critical that the flight controller is on its own.
pub(super) fn severity(event: &FlightEvent) -> MavSeverity {
    match event.level {
        _ if event.kind == "fallback_engaged" => MavSeverity::MAV_SEVERITY_CRITICAL,
        Level::Error => MavSeverity::MAV_SEVERITY_ERROR,
        Level::Warn => MavSeverity::MAV_SEVERITY_WARNING,
        Level::Info => MavSeverity::MAV_SEVERITY_INFO,
        Level::Debug => MavSeverity::MAV_SEVERITY_DEBUG,
    }
}

/// The messages of a text. A text that needs several gets the next id, and its last message ends with a null
/// character, as the specification requires: if it is full, an empty one follows. Characters that are not ASCII
/// become question marks.
pub(super) fn chunks(severity: MavSeverity, text: &str, last_id: &mut u16) -> Vec<STATUSTEXT_DATA> {
    // A null character would end the text.
    let printable = |c: char| if c.is_ascii() && c != '\0' { c as u8 } else { b'?' };
    let bytes: Vec<u8> = text.chars().map(printable).take(CHUNK * CHUNKS - 1).collect();
    let message = |chunk: &[u8], id, chunk_seq| {
        let mut text = [0; CHUNK];
        text.iter_mut().zip(chunk).for_each(|(to, from)| *to = *from);
        STATUSTEXT_DATA { severity, text: text.into(), id, chunk_seq }
    };
    if bytes.len() <= CHUNK {
        return vec![message(&bytes, 0, 0)];
    }
    // 0 marks a text in a single message.
    *last_id = last_id.checked_add(1).unwrap_or(1);
    let is_full = bytes.len().is_multiple_of(CHUNK);
    let chunks = bytes.chunks(CHUNK).chain(is_full.then_some(&[][..]));
    (0..=u8::MAX).zip(chunks).map(|(chunk_seq, chunk)| message(chunk, *last_id, chunk_seq)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::MonotonicTime;
    use bb_tests::laws;
    use proptest::prelude::*;

    /// Assembles the text as a ground station does.
    fn joined(messages: &[STATUSTEXT_DATA]) -> String {
        messages.iter().map(|message| message.text.to_str().expect("it is ASCII")).collect()
    }

    #[test]
    fn a_short_text_is_one_message() {
        let mut id = 41;
        for text in ["", "lost", &"x".repeat(50)] {
            let messages = chunks(MavSeverity::MAV_SEVERITY_INFO, text, &mut id);
            assert_eq!((messages.len(), messages[0].id, joined(&messages)), (1, 0, text.to_owned()));
        }
        assert_eq!(id, 41);
        let odd = chunks(MavSeverity::MAV_SEVERITY_INFO, "5 µs\0", &mut id);
        assert_eq!(joined(&odd), "5 ?s?");
    }

    #[test]
    fn ids_are_never_zero() {
        let mut id = u16::MAX;
        let messages = chunks(MavSeverity::MAV_SEVERITY_INFO, &"x".repeat(51), &mut id);
        assert!(messages.iter().all(|message| message.id == 1));
    }

    #[test]
    fn severities_are_those_of_the_levels() {
        let event = |level, kind: &str| FlightEvent {
            time: MonotonicTime::ZERO,
            frame_id: [0; 16],
            spoof_block: false,
            level,
            kind: kind.to_owned(),
            input: None,
            reason: None,
            from: None,
            to: None,
            status_text: None,
            window: None,
            cov_inflation: None,
            keyframe: None,
        };
        let of = |level, kind| severity(&event(level, kind)) as u8;
        let severities = [Level::Error, Level::Warn, Level::Info, Level::Debug].map(|level| of(level, "label"));
        assert_eq!((of(Level::Error, "fallback_engaged"), severities), (2, [3, 4, 6, 7]));
    }

    laws! {
        #[test]
        fn long_texts_arrive_whole(length in 51..CHUNK * CHUNKS - 1, letter in "[a-z]") {
            let text = letter.repeat(length);
            let mut id = 0;
            let messages = chunks(MavSeverity::MAV_SEVERITY_ERROR, &text, &mut id);
            prop_assert_eq!(joined(&messages), text);
            prop_assert!(messages.iter().enumerate().all(|(at, message)| message.chunk_seq as usize == at && message.id == 1));
            prop_assert_eq!(messages.last().map(|last| last.text[CHUNK - 1]), Some(0));
        }

        #[test]
        fn what_is_too_long_is_cut_off(length in CHUNK * CHUNKS - 1..CHUNK * CHUNKS + 200) {
            let messages = chunks(MavSeverity::MAV_SEVERITY_ERROR, &"x".repeat(length), &mut 0);
            prop_assert_eq!((messages.len(), joined(&messages).len()), (CHUNKS, CHUNK * CHUNKS - 1));
        }
    }
}
