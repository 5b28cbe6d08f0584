//! Asks every call for the token, before a byte of its messages is read.

use std::sync::Arc;

use starlings_proto::access::{TOKEN_KEY, Token};
use tonic::service::Interceptor;
use tonic::{Request, Status};

use super::connection::Whose;
use super::refusals::{Refusals, Why};

/// The token that calls must have; without one every call is taken.
#[derive(Clone)]
pub(crate) struct Check {
    token: Option<Arc<Token>>,
    refusals: Arc<Refusals>,
}

impl Check {
    pub(super) fn new(token: Option<Token>, refusals: Arc<Refusals>) -> Self {
        Self { token: token.map(Arc::new), refusals }
    }

    fn fault(&self, request: &Request<()>) -> Option<Why> {
        let token = self.token.as_ref()?;
        match request.metadata().get(TOKEN_KEY) {
            None => Some(Why::NoToken),
            Some(offered) if !token.is(offered.as_bytes()) => Some(Why::OtherToken),
            Some(_) => None,
        }
    }
}

impl Interceptor for Check {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        let fault = self.fault(&request);
        // Nothing behind this needs it.
        request.metadata_mut().remove(TOKEN_KEY);
        let whose = request.extensions().get::<Whose>();
        match (fault, whose) {
            (None, Some(Whose(caller))) => caller.prove(),
            (Some(why), Some(Whose(caller))) => {
                caller.refuse();
                self.refusals.note(caller.peer(), &why);
                return Err(Status::unauthenticated(why.to_string()));
            }
            // A connection that nobody let in.
            (_, None) => return Err(Status::unauthenticated("this call came through no door")),
        }
        Ok(request)
    }
}
