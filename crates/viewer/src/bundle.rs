//! The page itself, made by `build.rs`: three files, each also as gzip.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::LazyLock;

use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{Html, IntoResponse, Response};

struct File {
    plain: &'static [u8],
    zipped: &'static [u8],
}

/// `index.html`, `page.js`, `page.css`; or why this program was built without them.
static FILES: Result<[File; 3], &str> = include!(concat!(env!("OUT_DIR"), "/bundle.rs"));

/// Of the program and its page: pages that another build brought are told from this one's.
pub(crate) fn version() -> &'static str {
    static VERSION: LazyLock<String> = LazyLock::new(|| {
        let mut hasher = DefaultHasher::new();
        FILES.iter().flatten().for_each(|file| file.plain.hash(&mut hasher));
        format!("{}+{:08x}", env!("CARGO_PKG_VERSION"), hasher.finish() as u32)
    });
    &VERSION
}

/// Which file of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Page,
    Script,
    Style,
}

impl Part {
    const fn content_type(self) -> HeaderValue {
        HeaderValue::from_static(match self {
            Self::Page => "text/html; charset=utf-8",
            Self::Script => "text/javascript; charset=utf-8",
            Self::Style => "text/css; charset=utf-8",
        })
    }
}

/// Answers with a part of the page, as gzip when the browser takes that.
pub(crate) fn answer(part: Part, request: &HeaderMap) -> Response {
    let file = match &FILES {
        Ok(files) => &files[part as usize],
        Err(why) => return without_page(why),
    };
    let kind = [(header::CONTENT_TYPE, part.content_type()), (header::VARY, header::ACCEPT_ENCODING.into())];
    if takes_gzip(request) {
        return (kind, [(header::CONTENT_ENCODING, "gzip")], file.zipped).into_response();
    }
    (kind, file.plain).into_response()
}

/// Whether `Accept-Encoding` names gzip, and not with a quality of zero.
fn takes_gzip(request: &HeaderMap) -> bool {
    let accepted = request.get_all(header::ACCEPT_ENCODING).iter();
    accepted.filter_map(|value| value.to_str().ok()).flat_map(|value| value.split(',')).any(|coding| {
        let mut parts = coding.split(';').map(str::trim);
        let is_gzip = parts.next().is_some_and(|name| name.eq_ignore_ascii_case("gzip"));
        is_gzip && parts.all(|part| !matches!(part.trim_start_matches(['q', 'Q', '=']).parse(), Ok(0.0_f32)))
    })
}

/// A page that says how to get the real one.
fn without_page(why: &str) -> Response {
    Html(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>cotouch</title></head><body>\n\
         <h1>This cotouch was built without its page</h1>\n\
         <p>The session runs; only its picture is missing. To get it, install Node.js 20 or later with npm, run\n\
         <code>touch crates/viewer/build.rs</code> in cotouch's folder, and build again.</p>\n\
         <p>Why it is missing:</p>\n<pre>{}</pre>\n</body></html>\n",
        escaped(why)
    ))
    .into_response()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn accepting(coding: &str) -> HeaderMap {
        HeaderMap::from_iter([(header::ACCEPT_ENCODING, coding.parse().unwrap())])
    }

    #[test]
    fn gzip_goes_to_those_who_ask_for_it() {
        assert!(takes_gzip(&accepting("gzip, deflate, br, zstd")));
        assert!(takes_gzip(&accepting("br;q=1.0, GZIP;q=0.8")));
        for coding in ["", "br", "identity", "gzip;q=0", "gzip; q=0.0", "xgzip"] {
            assert!(!takes_gzip(&accepting(coding)), "{coding:?}");
        }
        assert!(!takes_gzip(&HeaderMap::new()));
    }

    #[test]
    fn a_missing_page_says_how_to_get_it_and_cannot_be_written_into() {
        let response = without_page("npm said <script>&");
        assert_eq!(response.headers()[header::CONTENT_TYPE], "text/html; charset=utf-8");
        assert_eq!(escaped("npm said <script>&"), "npm said &lt;script>&amp;");
    }
}
