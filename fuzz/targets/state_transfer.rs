//! The messages of a state's way: the head of a put, the request for one, its pieces, the answer.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prost::Message;
use starlings_proto::convert::lent::{GiveBack, Lend, decode_in_memory, encode_in_memory};
use starlings_proto::convert::piece_names::{decode_names, encode_names};
use starlings_proto::convert::state::{
    Get, PutHead, chunk_values, decode_chunk, decode_head, decode_put_result, encode_put_result, n_chunks,
};
use starlings_proto::generated;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(message) = generated::GetRequest::decode(bytes)
        && let Ok(get) = Get::decode(&message)
    {
        assert_eq!(Get::decode(&get.encode()), Ok(get));
    }
    if let Ok(message) = generated::PutResult::decode(bytes)
        && let Ok(state) = decode_put_result(&message)
    {
        assert_eq!(decode_put_result(&encode_put_result(&state)), Ok(state));
    }
    if let Ok(message) = generated::Chunk::decode(bytes)
        && let Ok(head) = PutHead::decode(&message)
    {
        assert_eq!(PutHead::decode(&head.encode()), Ok(head));
    }
    if let Ok(message) = generated::LendRequest::decode(bytes)
        && let Ok(lend) = Lend::decode(&message)
    {
        assert_eq!(Lend::decode(&lend.encode()), Ok(lend));
    }
    if let Ok(message) = generated::GiveBackRequest::decode(bytes)
        && let Ok(back) = GiveBack::decode(&message)
    {
        assert_eq!(GiveBack::decode(&back.encode()), Ok(back));
    }
    // A whole stream: messages one after the other, each after its length.
    let mut rest = bytes;
    let mut next = || generated::Chunk::decode_length_delimited(&mut rest).ok();
    let Some(Ok(n_state)) = next().map(|head| decode_head(&head)) else { return };
    let mut index = 0;
    while let Some(message) = next() {
        if let Ok(Some(number)) = decode_in_memory(&message) {
            assert_eq!(message, encode_in_memory(number));
            break;
        }
        let missing = n_chunks(n_state).saturating_sub(index);
        match decode_names(&message, missing) {
            Ok(Some(names)) => {
                assert!(names.len() <= missing);
                assert_eq!(decode_names(&encode_names(&names), missing), Ok(Some(names.clone())));
                index += names.len();
                continue;
            }
            Ok(None) => {}
            Err(_) => break,
        }
        let values = chunk_values(n_state, index);
        match decode_chunk(message, values) {
            Ok(piece) => assert_eq!(piece.len(), 8 * values),
            Err(_) => break,
        }
        index += 1;
    }
});
