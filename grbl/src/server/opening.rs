//! The first bytes of a connection: a browser that was told to send something here by a page is no client of grbl.

/// How requests of HTTP begin; no line of a program does.
const METHODS: [&[u8]; 9] = [
    b"GET ",
    b"POST ",
    b"PUT ",
    b"HEAD ",
    b"OPTIONS ",
    b"DELETE ",
    b"PATCH ",
    b"CONNECT ",
    b"TRACE ",
];

/// Looks at the first bytes of a connection.
#[derive(Debug)]
pub(super) struct Opening {
    /// Bytes that may be the beginning of a method; `None` once they are known to be none.
    held: Option<Vec<u8>>,
}

impl Default for Opening {
    fn default() -> Self {
        Self { held: Some(Vec::new()) }
    }
}

impl Opening {
    /// What of the bytes heard so far is for grbl; `None` where they are a request of HTTP.
    pub(super) fn take(&mut self, bytes: &[u8]) -> Option<Vec<u8>> {
        let Some(held) = &mut self.held else { return Some(bytes.to_vec()) };
        held.extend_from_slice(bytes);
        if METHODS.iter().any(|method| held.starts_with(method)) {
            return None;
        }
        if METHODS.iter().any(|method| method.starts_with(held)) {
            return Some(Vec::new());
        }
        self.held.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_of_a_browser_is_known_however_it_is_cut() {
        for request in ["POST / HTTP/1.1\r\n", "GET /x HTTP/1.1\r\n", "OPTIONS * HTTP/1.1\r\n"] {
            assert_eq!(Opening::default().take(request.as_bytes()), None);
            let mut opening = Opening::default();
            let heard: Vec<_> = request.bytes().map(|byte| opening.take(&[byte])).collect();
            let refused = heard.iter().position(Option::is_none);
            assert_eq!(refused, request.find(' '), "{request}");
            assert!(heard.iter().flatten().take(refused.unwrap_or(0)).all(Vec::is_empty));
        }
    }

    #[test]
    fn what_a_client_sends_comes_through_whole() {
        for sent in ["?", "G0 X1\n", "\x18", "$$\n", "G21\nG0X1\nPOST /\n"] {
            let mut opening = Opening::default();
            let heard: Vec<u8> =
                sent.bytes().flat_map(|byte| opening.take(&[byte]).unwrap_or_default()).collect();
            assert_eq!(heard, sent.as_bytes(), "{sent:?}");
        }
    }
}
