#![allow(clippy::unwrap_used)]

use super::*;
use axum::http::HeaderValue;
use axum::http::header::ORIGIN;
use std::os::unix::fs::PermissionsExt;

const OPERATE: &str = "operate-0123456789";
const WATCH: &str = "watch-0123456789ab";

fn access(trusts_own_user: bool) -> Access {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tokens");
    std::fs::write(&path, format!("operate {OPERATE}\nwatch {WATCH}\n")).unwrap();
    std::fs::set_permissions(&path, PermissionsExt::from_mode(0o600)).unwrap();
    let (tokens, _) = Tokens::open(&path).unwrap();
    Access::new(tokens, trusts_own_user, &["laser.example".to_owned()], 7180)
}

fn headers(list: &[(&'static str, &str)]) -> HeaderMap {
    let mut headers = HeaderMap::new();
    headers.insert(HOST, HeaderValue::from_static("127.0.0.1:7180"));
    for (name, value) in list {
        headers.insert(*name, HeaderValue::from_str(value).unwrap());
    }
    headers
}

fn peer(address: &str, user: PeerUser) -> Peer {
    Peer { address: address.parse().unwrap(), user }
}

#[test]
fn the_user_of_this_computer_needs_no_token_and_everybody_else_does() {
    let access = access(true);
    let right = |peer: &Peer| access.right(peer, &headers(&[]));
    assert_eq!(right(&peer("127.0.0.1", PeerUser::Own)), Ok(Some(Right::Operate)));
    assert_eq!(right(&peer("::1", PeerUser::Own)), Ok(Some(Right::Operate)));
    assert_eq!(right(&peer("::ffff:127.0.0.1", PeerUser::Own)), Ok(Some(Right::Operate)));
    for stranger in [
        peer("127.0.0.1", PeerUser::Other(1001)),
        peer("127.0.0.1", PeerUser::Unknown),
        peer("192.0.2.7", PeerUser::Elsewhere),
        peer("192.0.2.7", PeerUser::Own),
    ] {
        assert_eq!(right(&stranger), Ok(None), "{stranger:?}");
    }
    // Somebody behind a proxy of that user is not that user.
    for name in FORWARDED {
        let proxied = headers(&[(name, "192.0.2.9")]);
        assert_eq!(access.right(&peer("127.0.0.1", PeerUser::Own), &proxied), Ok(None));
    }
    let strict = self::access(false);
    assert_eq!(strict.right(&peer("127.0.0.1", PeerUser::Own), &headers(&[])), Ok(None));
}

#[test]
fn a_token_comes_by_header_or_cookie_and_gives_its_right() {
    let access = access(true);
    let stranger = peer("192.0.2.7", PeerUser::Elsewhere);
    let bearer = |token: &str| headers(&[("authorization", &format!("Bearer {token}"))]);
    assert_eq!(access.right(&stranger, &bearer(OPERATE)), Ok(Some(Right::Operate)));
    assert_eq!(access.right(&stranger, &bearer(WATCH)), Ok(Some(Right::Watch)));
    assert_eq!(access.right(&stranger, &bearer("operate-0123456780")), Err(Denied::WrongToken));
    let cookie = access.login(&stranger, WATCH).unwrap();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    let (pair, _) = cookie.split_once(';').unwrap();
    let sent = headers(&[("cookie", &format!("other=1; {pair}; graver_1=x"))]);
    assert_eq!(access.right(&stranger, &sent), Ok(Some(Right::Watch)));
    assert_eq!(access.login(&stranger, "no"), Err(Denied::WrongToken));
}

#[test]
fn wrong_tokens_are_slowed_down_by_address() {
    let access = access(true);
    let (one, other) =
        (peer("192.0.2.7", PeerUser::Elsewhere), peer("192.0.2.8", PeerUser::Elsewhere));
    let wrong = headers(&[("authorization", "Bearer wrong")]);
    for _ in 0..10 {
        assert_eq!(access.right(&one, &wrong), Err(Denied::WrongToken));
    }
    assert_eq!(access.right(&one, &wrong), Err(Denied::TooMany));
    assert_eq!(access.login(&one, OPERATE), Err(Denied::TooMany));
    assert_eq!(access.right(&other, &wrong), Err(Denied::WrongToken));
}

#[test]
fn only_our_own_names_are_answered() {
    let names = origin::own_names(&["Laser.example".to_owned()]);
    for own in [
        "localhost",
        "localhost:7180",
        "127.0.0.1:1",
        "[::1]:7180",
        "192.0.2.1",
        "laser.example:80",
    ] {
        assert!(origin::is_own(own, &names), "{own}");
    }
    for other in [
        "evil.example",
        "localhost.evil.example",
        "127.0.0.1.evil.example:7180",
        "",
        "[::1",
        "a:b:c",
    ] {
        assert!(!origin::is_own(other, &names), "{other}");
    }
    let access = access(true);
    let mut rebound = headers(&[]);
    rebound.insert(HOST, HeaderValue::from_static("evil.example:7180"));
    assert_eq!(access.right(&peer("127.0.0.1", PeerUser::Own), &rebound), Err(Denied::Host));
    rebound.remove(HOST);
    assert_eq!(access.right(&peer("127.0.0.1", PeerUser::Own), &rebound), Err(Denied::Host));
}

#[test]
fn a_page_of_another_site_changes_nothing() {
    let access = access(true);
    let own = peer("127.0.0.1", PeerUser::Own);
    let change = |list: &[(&'static str, &str)]| access.admit_change(&own, &headers(list));
    assert_eq!(change(&[("origin", "http://127.0.0.1:7180")]), Ok(()));
    assert_eq!(change(&[("x-graver", "1")]), Ok(()));
    assert_eq!(change(&[("authorization", "Bearer x")]), Ok(()));
    for foreign in ["http://evil.example", "null", "http://127.0.0.1:7181", "127.0.0.1:7180"] {
        let sent = [("origin", foreign), ("x-graver", "1")];
        assert_eq!(change(&sent), Err(Denied::Foreign), "{foreign}");
        let live = access.admit_live(&headers(&[("origin", foreign)]));
        assert_eq!(live, Err(Denied::Foreign), "{foreign}");
    }
    // As a form of another page sends it where the browser tells no origin.
    assert_eq!(change(&[]), Err(Denied::Foreign));
    assert_eq!(access.admit_live(&headers(&[])), Ok(()));
    assert!(headers(&[]).get(ORIGIN).is_none());
}
