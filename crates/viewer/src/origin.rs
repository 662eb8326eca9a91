//! Who may ask, and what every answer says about itself.

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};

/// Everything that the page may do: load its own script and style and talk to its own server.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data: blob:; \
     base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Headers of every answer.
pub(crate) const HEADERS: [(HeaderName, HeaderValue); 4] = [
    (header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY)),
    (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (header::CACHE_CONTROL, HeaderValue::from_static("no-store")),
];

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RequestRefusal {
    /// The name in `Host` could be anybody's: another site may have pointed it here (DNS rebinding).
    Host,
    /// The page that asks was served by someone else.
    Origin,
}

impl RequestRefusal {
    pub(crate) const fn in_words(self) -> &'static str {
        match self {
            Self::Host => "ask for this page by the server's IP address, or as localhost\n",
            Self::Origin => "this session can only be seen from its own page\n",
        }
    }
}

/// Lets through what asks for this server by address or as `localhost` and comes from its own page or from no page.
pub(crate) fn check(headers: &HeaderMap) -> Result<(), RequestRefusal> {
    let text = |name: HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or(""));
    let host = text(header::HOST).unwrap_or("");
    if !is_address(host) {
        return Err(RequestRefusal::Host);
    }
    match text(header::ORIGIN) {
        None => Ok(()),
        Some(origin) if origin.strip_prefix("http://") == Some(host) => Ok(()),
        Some(_) => Err(RequestRefusal::Origin),
    }
}

/// Whether `host` (with or without a port) is an IP address or `localhost`.
fn is_address(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
    name.eq_ignore_ascii_case("localhost") || bare.parse::<std::net::IpAddr>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(host: &str, origin: Option<&str>) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        headers
    }

    #[test]
    fn only_the_own_page_is_let_through() {
        for host in ["127.0.0.1:7700", "localhost:7700", "localhost", "[::1]:7700", "192.168.1.5:80"] {
            assert_eq!(check(&headers(host, None)), Ok(()), "{host}");
            assert_eq!(check(&headers(host, Some(&format!("http://{host}")))), Ok(()), "{host}");
            assert_eq!(
                check(&headers(host, Some("http://evil.example"))),
                Err(RequestRefusal::Origin),
                "{host}"
            );
            assert_eq!(check(&headers(host, Some("null"))), Err(RequestRefusal::Origin), "{host}");
        }
        for host in ["evil.example", "evil.example:7700", "127.0.0.1.evil.example", ""] {
            assert_eq!(check(&headers(host, None)), Err(RequestRefusal::Host), "{host}");
        }
        assert_eq!(check(&HeaderMap::new()), Err(RequestRefusal::Host));
    }
}
